"""What changes while the robot drives: called as hook(model, data, time_s), every STEP_S."""

import numpy as np

from worlds import CASTER_M, wheel_dofs


class Sag:
    """Both motors grow weaker as the battery empties: their gain falls linearly from 1 to `last` over `length_s`."""

    def __init__(self, last, length_s):
        self.last, self.length_s, self.full = last, length_s, None

    def __call__(self, model, _data, time_s):
        if self.full is None:
            self.full = model.actuator_gear[:, 0].copy()
        model.actuator_gear[:, 0] = self.full * (1 + (self.last - 1) * time_s / self.length_s)


class AirDrag:
    """A force -c |v| v on the chassis, c in N s²/m²."""

    def __init__(self, c):
        self.c = c

    def __call__(self, _model, data, _time_s):
        v = data.qvel[:2]
        data.xfrc_applied[1, :2] = -self.c * np.hypot(v[0], v[1]) * v


class Rub:
    """The right wheel rubs once a revolution: dry friction (N m) over a sector (rad) of its turn."""

    def __init__(self, friction_n_m, sector_rad):
        self.friction_n_m, self.sector_rad, self.where = friction_n_m, sector_rad, None

    def __call__(self, model, data, _time_s):
        if self.where is None:
            dof = wheel_dofs(model)[1]
            self.where = dof, model.jnt_qposadr[model.dof_jntid[dof]]
        dof, angle = self.where
        model.dof_frictionloss[dof] = self.friction_n_m * (data.qpos[angle] % (2 * np.pi) < self.sector_rad) + 1e-9


class LetGo:
    """The weld that holds the load lets go."""

    def __init__(self, time_s):
        self.time_s = time_s

    def __call__(self, _model, data, time_s):
        data.eq_active[0] = time_s < self.time_s


class Tyre:
    """Rubber tyres: what a force makes them creep is in proportion to how fast they roll, slip = compliance · force / load.

    Sets the time constant with which the engine's contact resists sliding, in each step, from the wheel's speed. A wheel that
    bears F creeps at F c with c the contact's `creep_m_s_n` per second of that constant.
    """

    def __init__(self, compliance, load_n, radius_m, creep_m_s_n):
        self.factor, self.radius_m, self.where = compliance / load_n / creep_m_s_n, radius_m, None

    def __call__(self, model, data, _time_s):
        if self.where is None:
            self.where = [(model.pair(n).id, dof) for n, dof in zip(("left", "right"), wheel_dofs(model), strict=True)]
        for pair, dof in self.where:
            model.pair_solreffriction[pair] = max(0.001, self.factor * abs(data.qvel[dof]) * self.radius_m), 1.0


class Tether:
    """A spring (N/m) from the robot to a post where it began."""

    def __init__(self, stiffness_n_m):
        self.stiffness_n_m = stiffness_n_m

    def __call__(self, _model, data, _time_s):
        data.xfrc_applied[1, :2] = -self.stiffness_n_m * data.qpos[:2]


class CasterDrag:
    """The rear caster drags: dry friction (N) where it stands, against the way it goes there."""

    def __init__(self, friction_n):
        self.friction_n = friction_n

    def __call__(self, _model, data, _time_s):
        arm = data.xmat[1].reshape(3, 3)[:2, 0] * -CASTER_M[0]
        speed = data.qvel[:2] + data.qvel[5] * np.array([-arm[1], arm[0]])
        force = -self.friction_n * speed / max(np.hypot(*speed), 0.005)
        data.xfrc_applied[1, :2] = force
        data.xfrc_applied[1, 5] = arm[0] * force[1] - arm[1] * force[0]
