"""Files to start from: trials, controllers, model files and role maps."""

from importlib.resources import files
from pathlib import Path

FOLDER = Path(str(files(__name__)))
TRIALS = FOLDER / "trials"
CONTROLLERS = FOLDER / "controllers"
MODELS = FOLDER / "models"
ROLES = FOLDER / "roles"
