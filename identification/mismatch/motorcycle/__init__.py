"""The motorcycle as a system that the engine explains; nothing else here knows of vehicles."""
