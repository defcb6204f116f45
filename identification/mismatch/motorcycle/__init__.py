"""The motorcycle as a system of the mismatch engine, which does not depend on vehicles."""
