"""What a law is given at a control instant: the errors, and the nominal model half a period ahead."""

from typing import Any

from spherical_wrist.dynamics import Nominal, evaluate
from spherical_wrist.so3 import State, advance, attitude_error, feed_forward, rate_error


def sense(signal: Any, settings: Any, k: int, q: Any, rate: Any, desired: Any, rate_age: float) -> None:
    """Writes what is measured and desired at control instant k of this call of the loop, and the tracking errors.

    Args:
        signal: written.
        settings: a SETTINGS record.
        k: number of the instant.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: the reference, as MOTION, at the time of the attitude.
        rate_age: how much older than the attitude the rate is known to be [s].
    """
    d, v, a = desired.attitude, desired.rate, desired.acceleration
    target = (d[0], d[1], d[2], d[3])
    e = attitude_error(q, target)
    then = (v[0] - rate_age * a[0], v[1] - rate_age * a[1], v[2] - rate_age * a[2])
    de = rate_error(q, rate, target, then)
    signal.time = (settings.first + k) * settings.period
    signal.period = settings.period
    for i in range(4):
        signal.attitude[i] = q[i]
        signal.desired_attitude[i] = d[i]
    for i in range(3):
        signal.rate[i] = rate[i]
        signal.desired_rate[i] = v[i]
        signal.error[i] = e[i]
        signal.rate_error[i] = de[i]


def model_ahead(
    signal: Any, rate_scale: float, nominal: Nominal, q: Any, rate: Any, desired: Any, ahead: Any, horizon: float
) -> None:
    """Writes feed-forward, H and N, at the state that :func:`predict` finds.

    Args:
        signal: written.
        rate_scale: multiplies the rate at which N is evaluated; 0 leaves gravity.
        nominal: the nominal model.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: the reference, as MOTION, at the time of the measurement.
        ahead: the reference at the time that is predicted.
        horizon: from the one to the other [s]; 0 for no prediction.
    """
    then = predict(signal, q, rate, desired, ahead, horizon)
    w = then.rate
    scaled = (rate_scale * w[0], rate_scale * w[1], rate_scale * w[2])
    evaluate(nominal, then.attitude, scaled, signal.H, signal.N)


def predict(signal: Any, q: Any, rate: Any, desired: Any, ahead: Any, horizon: float) -> State:
    """Writes the feed-forward at the state predicted for ``horizon`` seconds after the measured one, and returns that.

    The torque is held over the whole period, so the model is best evaluated for the middle of it. The prediction takes
    the feed-forward at the measured state for the acceleration until then.

    Args:
        signal: written.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: the reference, as MOTION, at the time of the measurement.
        ahead: the reference at the time that is predicted.
        horizon: from the one to the other [s]; 0 for no prediction.
    """
    d, v, a = desired.attitude, desired.rate, desired.acceleration
    if horizon > 0.0:
        now = feed_forward(q, rate, (d[0], d[1], d[2], d[3]), (v[0], v[1], v[2]), (a[0], a[1], a[2]))
        q, rate = advance(q, rate, now, horizon)
        d, v, a = ahead.attitude, ahead.rate, ahead.acceleration
    then = feed_forward(q, rate, (d[0], d[1], d[2], d[3]), (v[0], v[1], v[2]), (a[0], a[1], a[2]))
    signal.horizon = horizon
    for i in range(3):
        signal.feed_forward[i] = then[i]
    return State(q, rate)
