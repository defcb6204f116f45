"""Lines on a replay for people."""

import numpy as np
import numpy.typing as npt

from slipbench.identification.ecu.replay import AGREES, Replayed


def lines(done: Replayed) -> list[str]:
    """Command of the script on the recording, and how it differs from the design."""
    known = np.isfinite(done.samples.ratio)
    active = (done.script.throttle < 0.0) | (done.script.spark < 0.0)
    verdict = "same commands" if done.agrees else "DIFFERENT commands"
    return [
        f"replayed: {known.size} ticks of {1000 * done.law.tick:g} ms, slip known in {_share(known)}",
        f"reducing in {_share(active)}; least throttle offset {100 * done.script.throttle.min():.2f} %,"
        f" least spark offset {np.degrees(done.script.spark.min()):.2f} deg",
        f"script and controller: {verdict}; largest difference {100 * done.difference:.3f} % of the"
        f" largest reduction (limit {100 * AGREES:g} %, single precision)",
    ]


def _share(of: npt.NDArray[np.bool_]) -> str:
    return f"{100 * float(np.mean(of)):.1f} % of the ticks"
