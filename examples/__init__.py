"""Files to start from: trials, controllers, model files, role maps and bindings."""

from importlib.resources import files
from pathlib import Path

FOLDER = Path(str(files(__name__)))
TRIALS = FOLDER / "trials"
CONTROLLERS = FOLDER / "controllers"
MODELS = FOLDER / "models"
ROLES = FOLDER / "roles"
BINDINGS = FOLDER / "bindings"
