"""What Lyapunov's theory says of a run, eq. (18)–(22) and (36)–(43): does K cover what the model misses?"""

from spherical_wrist.lyapunov.monitor import Lyapunov, monitor
from spherical_wrist.lyapunov.reaching import Reaching, reaching, reaching_bound

__all__ = ["Lyapunov", "Reaching", "monitor", "reaching", "reaching_bound"]
