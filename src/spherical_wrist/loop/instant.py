"""Signal of a law at a control instant: tracking errors, and the nominal model half a period ahead."""

from typing import Any

from spherical_wrist.dynamics import Nominal, evaluate
from spherical_wrist.so3 import State, advance, attitude_error, feed_forward, rate_error


def write_errors(signal: Any, settings: Any, k: int, q: Any, rate: Any, desired: Any, rate_age: float) -> None:
    """Write measured state, desired state and tracking errors of a control instant to the signal.

    Args:
        signal: SIGNAL record, written.
        settings: SETTINGS record.
        k: index of the control instant in this call of the loop.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: MOTION record of the reference at the time of the measured attitude.
        rate_age: known age of the rate minus that of the attitude [s].
    """
    d, v, a = desired.attitude, desired.rate, desired.acceleration
    target = (d[0], d[1], d[2], d[3])
    e = attitude_error(q, target)
    then = (v[0] - rate_age * a[0], v[1] - rate_age * a[1], v[2] - rate_age * a[2])
    de = rate_error(q, rate, target, then)
    signal.time = (settings.first + k) * settings.period
    signal.period = settings.period
    signal.rate_age = rate_age
    for i in range(4):
        signal.attitude[i] = q[i]
        signal.desired_attitude[i] = d[i]
    for i in range(3):
        signal.rate[i] = rate[i]
        signal.desired_rate[i] = v[i]
        signal.error[i] = e[i]
        signal.rate_error[i] = de[i]


def write_model(
    signal: Any, rate_scale: float, nominal: Nominal, q: Any, rate: Any, desired: Any, ahead: Any, horizon: float
) -> None:
    """Write feed-forward, H and N at the state predicted by :func:`predict`.

    Args:
        signal: SIGNAL record, written.
        rate_scale: factor on the rate at which N is evaluated; with 0, N is gravity alone.
        nominal: nominal model.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: MOTION record of the reference at the time of the measurement.
        ahead: MOTION record of the reference at the predicted time.
        horizon: time from the measurement to the predicted time [s]; 0 for no prediction.
    """
    then = predict(signal, q, rate, desired, ahead, horizon)
    w = then.rate
    scaled = (rate_scale * w[0], rate_scale * w[1], rate_scale * w[2])
    evaluate(nominal, then.attitude, scaled, signal.H, signal.N)


def predict(signal: Any, q: Any, rate: Any, desired: Any, ahead: Any, horizon: float) -> State:
    """Predict the state ``horizon`` seconds after the measured one, and write the feed-forward there to the signal.

    The torque is held over the whole control period, so the model is best evaluated for the middle of the period. The
    prediction assumes a constant acceleration: the feed-forward at the measured state.

    Args:
        signal: SIGNAL record, written.
        q: measured attitude.
        rate: measured rate [rad/s].
        desired: MOTION record of the reference at the time of the measurement.
        ahead: MOTION record of the reference at the predicted time.
        horizon: time from the measurement to the predicted time [s]; 0 for no prediction.
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
