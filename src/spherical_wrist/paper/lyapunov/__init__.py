"""Lyapunov's theory applied to a run, eq. (18)–(22) and (36)–(43): is K larger than the model mismatch?"""

from spherical_wrist.paper.lyapunov.monitor import Lyapunov, monitor
from spherical_wrist.paper.lyapunov.reaching import Reaching, reaching, reaching_bound

__all__ = ["Lyapunov", "Reaching", "monitor", "reaching", "reaching_bound"]
