"""Words of sensors, times and thermometers, in the languages of those who log them."""

from __future__ import annotations

AXES = ("x", "y", "z")
"""Names of the axes of a sensor."""

AXIS = ("axis", "achse", "axe", "eje", "asse", "eixo", "os", "ось")
"""Words that stand beside them and say no more."""

SENSORS = {
    "a": (
        "a f acc accel accelero accelerometer acceleration accs accl acce ac"
        " beschleunigung aceleracion aceleracao accelerazione versnelling"
        " przyspieszenie ускорение 加速度 가속도"
    ).split(),
    "g": (
        "g w pqr gyr gyro gyroscope gyros omega rate gy gyroskop giroscopio giroskop"
        " drehrate winkelgeschwindigkeit гироскоп 角速度 陀螺仪 ジャイロ 각속도 자이로"
    ).split(),
    "m": "m mag magnetometer magnetic compass 磁场 地磁気 磁気".split(),
    "v": "gravity grav".split(),
}
"""Words of accelerometers, gyroscopes, magnetometers and of gravity."""

PHRASES = (
    (("angular", "velocity"), "g"),
    (("angular", "rate"), "g"),
    (("angular", "vel"), "g"),
    (("ang", "vel"), "g"),
    (("rotation", "rate"), "g"),
    (("angle", "rate"), "g"),
    (("gyro", "rotation"), "g"),
    (("velocidad", "angular"), "g"),
    (("velocidade", "angular"), "g"),
    (("velocita", "angolare"), "g"),
    (("vitesse", "angulaire"), "g"),
    (("vitesse", "rot"), "g"),
    (("predkosc", "katowa"), "g"),
    (("угловая", "скорость"), "g"),
    (("specific", "force"), "a"),
    (("rate", "of", "turn"), "g"),
    (("rate", "of", "rotation"), "g"),
    (("linear", "acceleration"), "linear"),
    (("linear", "accel"), "linear"),
    (("accelerometer", "acceleration"), "a"),
)
"""The same in several words; of what is called linear, gravity may be taken out."""

GAINS = (
    (("delta", "angle"), "g"),
    (("delta", "theta"), "g"),
    (("delta", "velocity"), "a"),
    (("delta", "vel"), "a"),
    (("vel", "inc"), "a"),
    (("dv",), "a"),
    (("d", "v"), "a"),
)
"""Names of what angle and velocity gained since the row before."""

TURNS = (("ori", "inc"), ("dq",), ("d", "q"))
"""Names of the quaternion of the turn since the row before, of which x y z are half the
angle about each axis: those of Xsens and Movella."""

TIMES = ("t", "time", "timestamp", "stamp", "timestamps", "ts", "tstamp", "sensortime",
         "epoch", "epoc", "unixtime", "datetime", "zeit", "zeitstempel", "tiempo",
         "temps", "horodatage", "tempo", "tijd", "czas", "время", "时间", "時間",
         "時刻", "経過時間", "시간", "sow", "tow")  # fmt: skip

SINCE = ("elapsed", "epoch", "uptime", "since", "start", "boot", "realtime",
         "monotonic", "mono")  # fmt: skip
"""Words of a time where a unit of time stands beside them."""

STEPS = (("dt",), ("delta", "t"), ("delta", "time"), ("time", "delta"), ("deltat",),
         ("time", "step"), ("sample", "interval"))  # fmt: skip
"""Names of the time that passed since the row before."""

BARE_STEPS = (("delta",), ("interval",))
"""Likewise where a unit of time stands beside them."""

TEMPERATURES = ("temp", "temperature", "tmp", "temper", "temperatur", "temperatura",
                "температура", "温度", "気温", "온도")  # fmt: skip

WITHOUT_GRAVITY = ("user", "lin", "linear", "free", "dyn", "dynamic", "world",
                   "earth", "global", "ned", "enu", "rotated", "est",
                   "estimated")  # fmt: skip
"""Words of accelerations that may lack gravity, lie in axes of the Earth, or are what a
filter computes of others."""
