"""The Go2 simulated in MuJoCo, behind the same interface as the robot."""

from __future__ import annotations

import logging
from functools import cached_property, partial
from pathlib import Path
from typing import NoReturn

import mujoco
import numpy as np
from jaxtyping import Float

from go2_wbc.arguments import typed
from go2_wbc.errors import ClosedError, CommandError, ConfigError, PlantError, unknown_name
from go2_wbc.legs import LEGS
from go2_wbc.plant.base import Plant, Scan
from go2_wbc.plant.faults import HELD_TIME, Faults, InjectedFault
from go2_wbc.plant.mujoco.forces import (
    LIMB_BIN,
    ROBOT_BINS,
    TRUNK_BIN,
    Contacts,
    FootContacts,
    Pushes,
    foot_contacts,
    ground_forces,
    read_joints,
)
from go2_wbc.plant.mujoco.lidar import DepthConfig, LidarConfig, RangeSensor, chosen
from go2_wbc.plant.mujoco.model import ACCELEROMETER, GYRO, ORIENTATION, JointDynamics
from go2_wbc.plant.mujoco.setup import PlantSetup, SavedPhysics, prepare, settle
from go2_wbc.plant.mujoco.variation import DelayedCommands, Variation
from go2_wbc.plant.sensors import NONE, ImuSample, Proprioception, SensorErrors, SensorNoise
from go2_wbc.plant.terrain import Terrain
from go2_wbc.records import packed
from go2_wbc.robot.description import GO2
from go2_wbc.robot.estimator_config import EstimatorConfig
from go2_wbc.robot.model import RobotModel
from go2_wbc.robot.motor import TORQUE_SPEED, MotorModel, drive
from go2_wbc.robot.state import JointCommand, OdometryCovariance, PartFault, RobotState
from go2_wbc.world import SENSORS, World

_logger = logging.getLogger(__name__)

# N; a foot reads a contact above this. A standing foot carries about 40 N, so 1 N is "touching".
FOOT_CONTACT_THRESHOLD = 1.0


class MujocoPlant(Plant):
    """A robot in MuJoCo, driven by torques only; at time 0 it lies on the ground, folded, damped.

    The motor law is evaluated at every physics step, clipped to the motors' limits at the present
    speeds. Contact forces and torques that ``read`` reports acted over the last physics step and
    the last control period, respectively; positions and velocities are those of this instant.

    Args:
        mjcf: a user's own MJCF or scene of the robot; ``None`` builds the model from the URDF.
        keyframe: name of a keyframe of ``mjcf`` in which the robot starts instead of lying: its
            joints are held there until it rests. ``GO2Controller.take_over`` goes on from a stance.
        timestep: physics step [s]; overrides the one of ``mjcf``.
        control_period: seconds per ``write``, an integer multiple of ``timestep``.
        friction: sliding friction coefficient; ``None`` is 0.8, or the value of ``mjcf``. With
            ``mjcf`` a number applies to the feet's contacts.
        payload: extra mass [kg], a solid box; payload_place: position of its middle in the base
            frame [m].
        mass_scale: factor on every mass and inertia of the robot, without the payload.
        terrain: the ground (``plant.terrain``) instead of a level floor; only without ``mjcf``.
        sensors: ``"ideal"``, ``"noisy"`` for white noise on all measurements, or ``"imu"``: all
            that ``read`` gives is estimated from IMU, encoders and feet, in a world of its own.
        noise: standard deviations of ``"noisy"``.
        errors: of the sensors of ``"imu"``.
        estimator: numbers of the estimator of ``"imu"``.
        seed: of the noise, the errors and ``initial_joint_noise``.
        initial_yaw: heading at the start [rad].
        initial_joint_noise: standard deviation [rad] of the joint angles from which it settles.
        joint_dynamics: friction, damping, armature; ``None`` is the profile's, or the file's.
        motor: ``"torque-speed"``, or ``"ideal"`` for the peak torque at every speed.
        urdf: another URDF instead of the installed one.
        robot: name of its profile: "go2", "a1" or "go1".
        visuals: also load the visual meshes (slower), for the viewer and for rendering.
        delay: time [s] after which a command acts, rounded to whole physics steps.
        lidar: whether the robot has a lidar, or its numbers; only without ``mjcf``.
        depth: the same for a depth camera that looks ahead, in place of the lidar.

    Raises:
        ClosedError: from all calls, once it is closed.
        ConfigError: for a value that is out of range.
        ModelMismatch: if ``mjcf`` cannot be read or lacks something; lists all problems.
        DescriptionError: if the robot's files are missing or broken.
    """

    @typed("noise", "errors", "estimator")
    def __init__(
        self,
        mjcf: Path | str | None = None,
        *,
        timestep: float = 0.002,
        control_period: float = 0.002,
        friction: float | None = None,
        payload: float = 0.0,
        payload_place: tuple[float, float, float] = (0.0, 0.0, 0.0),
        mass_scale: float = 1.0,
        terrain: Terrain | None = None,
        sensors: str = "ideal",
        noise: SensorNoise | None = None,
        errors: SensorErrors | None = None,
        estimator: EstimatorConfig | None = None,
        seed: int = 0,
        initial_yaw: float = 0.0,
        initial_joint_noise: float = 0.0,
        joint_dynamics: JointDynamics | None = None,
        motor: str = TORQUE_SPEED,
        urdf: Path | str | None = None,
        robot: str = GO2,
        visuals: bool = False,
        delay: float = 0.0,
        keyframe: str | None = None,
        lidar: LidarConfig | bool = False,
        depth: DepthConfig | bool = False,
    ) -> None:
        if str(sensors) not in SENSORS:
            raise ConfigError(unknown_name("sensors", sensors, SENSORS))
        sight = chosen(lidar, depth, mjcf)
        setup = PlantSetup(
            mjcf=mjcf,
            urdf=urdf,
            robot=robot,
            timestep=timestep,
            control_period=control_period,
            friction=friction,
            payload=payload,
            payload_place=payload_place,
            mass_scale=mass_scale,
            terrain=terrain,
            initial_yaw=initial_yaw,
            initial_joint_noise=initial_joint_noise,
            joint_dynamics=joint_dynamics,
            motor=motor,
            visuals=visuals,
            delay=delay,
            seed=seed,
            keyframe=keyframe,
        )
        start_rng, self._rng = np.random.default_rng(seed).spawn(2)
        # MuJoCo's warnings would otherwise go to a file in the working directory.
        mujoco.set_mju_user_warning(partial(_logger.warning, "MuJoCo: %s"))
        self._model, self._layout, self._motor, self._description = prepare(setup)
        self._data = mujoco.MjData(self._model)
        self.robot = self._description.profile.name
        self.model_file = str(Path(mjcf or urdf or "").absolute()) if mjcf or urdf else ""
        if mjcf is not None and joint_dynamics is None:  # of what is built here nobody is told
            self.joint_damping = tuple(self._model.dof_damping[self._layout.joint_v].tolist())
        self._noise = (noise or SensorNoise()) if sensors == "noisy" else None
        self._period, self._substeps = control_period, round(control_period / timestep)
        self._closed, self._ticks, self._is_users = False, 0, mjcf is not None
        self._commands = DelayedCommands(self._substeps, round(delay / timestep))
        self._faults = Faults(self._description)
        self._pushes = Pushes(self._model, self._data, self._layout)
        # Views into MuJoCo's memory, made once because making them is slow.
        data, layout = self._data, self._layout
        self._base_q, self._base_v = data.qpos[layout.base_q], data.qvel[layout.base_v]
        self._R_world_base = data.xmat[layout.base].reshape(3, 3)
        self._warnings = data.warning.number
        self._bind_kernels()
        resting = settle(self._model, data, layout, setup, start_rng)
        # One period in the resting state, so that the first read has forces and torques.
        self._senses: Proprioception | None = None
        self._state: RobotState | None = None
        self._imu: ImuSample | None = None
        self._ranges: RangeSensor | None = None
        if sight is not None:
            rng, body = np.random.default_rng((seed, sight.rays)), (self._model, self._data)
            self._ranges = RangeSensor(sight, terrain, body, rng)
        self.write(resting)
        self._ticks, self._data.time = 0, 0.0
        if sensors == "imu":
            errors = errors or SensorErrors()
            own = RobotModel(self._description), control_period, self._rng
            self._senses = Proprioception(errors, *own, estimator)
            self._sense()

    @property
    def control_period(self) -> float:
        """Seconds that pass in one ``write``."""
        return self._period

    @property
    def time(self) -> float:
        """Plant time [s]: the number of writes times the control period."""
        return self._ticks * self._period

    @property
    def torque_limits(self) -> Float[np.ndarray, "12"]:
        """Largest torque of each joint [N m]."""
        return self._layout.torque_limits.copy()

    @property
    def motor(self) -> MotorModel:
        """What the motors give at which speed."""
        return self._motor

    @property
    def model(self) -> mujoco.MjModel:
        """MuJoCo's model, for viewers and measurements."""
        self._check_open()
        return self._model

    @property
    def data(self) -> mujoco.MjData:
        """MuJoCo's data, for viewers and measurements; writing to it is at your own risk."""
        self._check_open()
        return self._data

    @property
    def total_mass(self) -> float:
        """Mass of the robot with its payload [kg]."""
        self._check_open()
        return float(self._model.body_subtreemass[self._layout.base])

    def read(self) -> RobotState:
        """The state now; reading again before the next ``write`` gives the same values."""
        self._check_open()
        if self._state is None:
            state, noise = self.truth(), self._noise
            self._state = state if noise is None else noise.corrupt_state(state, self._rng)
            if self._faults.known:
                self._state = self._faults.seen(self._state, self.imu(), FOOT_CONTACT_THRESHOLD)
        return self._state

    @property
    def odometry_covariance(self) -> OdometryCovariance:
        """How sure what ``read`` says of the base is."""
        return (self._senses or self._noise or NONE).covariance

    def truth(self) -> RobotState:
        """The true state now, for tests and judges; ``read`` gives the same with ideal sensors."""
        if self._truth is None:
            q, v = np.empty(19), np.empty(18)
            self._read_joints(q, v)
            forces = self._forces[: len(LEGS)].copy()
            touching = forces > FOOT_CONTACT_THRESHOLD
            self._truth = RobotState(self.time, q, v, self._tau.copy(), forces, touching)
        return self._truth

    @typed(late=True)
    def write(self, command: JointCommand) -> None:
        """Applies ``command`` for one control period, with the motor law at every physics step.

        Raises:
            CommandError: for a value that is not finite or an array of the wrong shape; nothing
                is applied and no time passes.
            PlantError: if the physics diverges.
            ClosedError: after ``close()``.
        """
        self._check_open()
        self._commands.write(command.numbers())
        model, data = self._model, self._data
        total, shares = np.zeros(12), None
        if self._faults.known:
            shares = self._faults.torque_shares(self.time)
            for hold in self._faults.begun_holds(self.time, self._period):
                self._pushes.hold(hold.part, hold.value, HELD_TIME)
        for step in range(self._substeps):
            drive(self._commands.acting(step), *self._motors, total)
            if shares is not None:
                data.ctrl[self._layout.motors] *= shares
            self._pushes.apply()
            mujoco.mj_step2(model, data)
            if step == self._substeps - 1:
                self._forces = self._ground_forces()
            mujoco.mj_step1(model, data)
        self._tau = total / self._substeps if shares is None else total * shares / self._substeps
        self._ticks += 1
        if np.count_nonzero(self._warnings):
            raised = [mujoco.mju_warningText(int(i), 0) for i in np.flatnonzero(self._warnings)]
            raise PlantError(f"physics failed at t={self.time:.3f} s: {'; '.join(raised)}")
        self._sense()

    def scan(self) -> Scan | None:
        """See ``Plant.scan``."""
        return None if self._ranges is None else self._ranges.scan(self.time)

    def imu(self) -> ImuSample:
        """The inertial measurement unit's reading; its accelerometer lags by one physics step."""
        self._check_open()
        if self._imu is None:
            sample, noise = self._true_imu(), self._noise
            self._imu = sample if noise is None else noise.corrupt_imu(sample, self._rng)
        return self._imu

    @typed(error=CommandError, late=True)
    def push(self, force: Float[np.ndarray, "3"], duration: float, at: str = "base") -> None:
        """Pushes the robot, starting now; pushes overlay.

        Args:
            force: in the world [N].
            duration: [s], rounded to whole physics steps, at least one.
            at: ``"base"``, a foot (``"FL_foot"``), or any body; acts at the centre of mass of a
                body and at the centre of a foot.

        Raises:
            CommandError: if a value is not finite, ``duration`` not positive, or ``at`` unknown.
        """
        self._check_open()
        self._pushes.add(force, duration, at)

    @typed(error=CommandError, late=True)
    def fault(
        self, kind: str, part: str = "", at: float | None = None, value: float | None = None
    ) -> None:
        """Breaks a part of the robot, for tests and experiments.

        Args:
            kind: a value of ``go2_wbc.plant.faults.FaultKind``, such as ``"motor"``.
            part: a joint (``"FL_calf_joint"``), a foot (``"FL_foot"``) or an axis (``"x"``).
            at: plant time [s]; now, unless said.
            value: what the part gives, or errs by; see ``FaultKind``.

        Raises:
            CommandError: for a kind or a part that does not exist, or a number that is none.
        """
        self._check_open()
        fault = InjectedFault.of(kind, part, self.time if at is None else max(at, self.time), value)
        if self._senses is None and not self._faults.known:  # how it reads while it is sound
            self._faults.seen(self.read(), self.imu(), FOOT_CONTACT_THRESHOLD)
        self._faults.known += (fault,)

    @property
    def motors_obey(self) -> bool:
        """True; see ``Plant.motors_obey``."""
        return True

    @property
    def sensor_faults(self) -> tuple[PartFault, ...]:
        """See ``Plant.sensor_faults``; who is told the true state looks once a part is broken."""
        watch = self._senses or self._faults.watch
        return () if watch is None else watch.faults

    @typed(late=True)
    def place(self, q: Float[np.ndarray, "19"], v: Float[np.ndarray, "18"] | None = None) -> None:
        """Moves the robot to a state at once, for tests and experiments; time stands still.

        Args:
            q: base position, quaternion x y z w, joint angles; joint limits are not checked.
            v: velocity as in ``RobotState``; ``None`` is at rest.

        Raises:
            CommandError: if a value is not finite or the quaternion is zero.
        """
        self._check_open()
        v = np.zeros(18) if v is None else v
        length = float(np.linalg.norm(q[3:7]))
        if not (np.isfinite(q).all() and np.isfinite(v).all() and length > 0.0):
            raise CommandError(f"cannot place the robot at q={q}, v={v}")
        data, layout = self._data, self._layout
        self._base_q[:3], self._base_q[3:] = q[:3], q[[6, 3, 4, 5]] / length
        data.qpos[layout.joint_q], data.qvel[layout.joint_v] = q[7:], v[6:]
        mujoco.mj_kinematics(self._model, data)
        self._base_v[:3], self._base_v[3:] = self._R_world_base @ v[:3], v[3:6]
        data.qacc_warmstart[:] = 0.0
        mujoco.mj_step1(self._model, data)
        self._forces = np.zeros(ROBOT_BINS)
        if self._senses is not None:
            self._senses.restart()
        if self._faults.watch is not None:
            self._faults.watch.restart()
        self._sense()

    @typed("world")
    def vary(self, world: World) -> None:
        """Puts the robot into another world, as if it had been built there; time stands still.

        Payload and sensors stay. Commands on their way are lost.

        Raises:
            ConfigError: for another payload.
        """
        self._check_open()
        self._variation.apply(world)
        self._commands.delay(round(world.delay / self._model.opt.timestep))
        mujoco.mj_step1(self._model, self._data)

    @property
    def p_world_feet(self) -> Float[np.ndarray, "4 3"]:
        """Centres of the feet in the world [m]."""
        self._check_open()
        return self._data.geom_xpos[self._layout.foot_geoms].copy()

    def foot_contacts(self) -> FootContacts:
        """Contact points of the feet and the velocities of their material there."""
        return FootContacts(*(rows[0] for rows in foot_contacts([self.contacts()])))

    def contacts(self) -> Contacts:
        """Every contact now, to be evaluated later."""
        self._check_open()
        return Contacts.of(self._data, self._layout)

    @property
    def body_contact_force(self) -> float | None:
        """See ``Plant.body_contact_force``."""
        return self.base_contact_force + self.limb_contact_force

    @property
    def base_contact_force(self) -> float:
        """Normal force between the trunk and anything that is not the robot [N]."""
        return float(self._forces[TRUNK_BIN])

    @property
    def limb_contact_force(self) -> float:
        """Normal force between the legs, feet excepted, and anything that is not the robot [N]."""
        return float(self._forces[LIMB_BIN])

    def save(self) -> SavedPhysics:
        """Everything that decides what happens next; ``restore`` goes on from there, bit by bit."""
        self._check_open()
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        integration = np.empty(mujoco.mj_stateSize(self._model, kind))
        mujoco.mj_getState(self._model, self._data, integration, kind)
        return SavedPhysics(
            integration=integration,
            ticks=self._ticks,
            pushes=self._pushes.active,
            commands=self._commands.save(),
            tau=self._tau,
            forces=self._forces,
            noise_state=self._rng.bit_generator.state,
            state=self._state,
            imu=self._imu,
            senses=None if self._senses is None else self._senses.save(),
            faults=self._faults.save(),
            lidar=None if self._ranges is None else self._ranges.save(),
        )

    @typed(late=True)
    def restore(self, saved: SavedPhysics) -> None:
        """Goes back to a state that ``save`` of this plant, or of one built alike, returned."""
        self._check_open()
        kind = mujoco.mjtState.mjSTATE_INTEGRATION
        mujoco.mj_setState(self._model, self._data, saved.integration, kind)
        mujoco.mj_step1(self._model, self._data)
        self._warnings[:] = 0
        self._ticks = saved.ticks
        self._pushes.active = saved.pushes
        self._commands.restore(*saved.commands)
        self._tau, self._forces = saved.tau, saved.forces
        self._rng.bit_generator.state = dict(saved.noise_state)
        self._truth, self._state, self._imu = None, saved.state, saved.imu
        if self._senses is not None and saved.senses is not None:
            self._senses.restore(saved.senses)
        self._faults.restore(saved.faults)
        if self._ranges is not None and saved.lidar is not None:
            self._ranges.restore(saved.lidar)

    def close(self) -> None:
        """Ends the plant; every later call but ``close`` raises ``ClosedError``."""
        self._closed = True

    def __repr__(self) -> str:
        now = "closed" if self._closed else f"{self.time:.3f} s"
        mass = float(self._model.body_subtreemass[self._layout.base])
        return f"<MujocoPlant: {mass:.2f} kg, {now}>"

    def __reduce__(self) -> NoReturn:
        """A simulation is no value: it cannot be pickled or copied."""
        raise TypeError("a MujocoPlant holds a running simulation: make one in each process")

    @cached_property
    def _variation(self) -> Variation:
        return Variation(self._model, self._layout, is_users=self._is_users)

    def _check_open(self) -> None:
        if self._closed:
            raise ClosedError("the MuJoCo plant is closed")

    def _sense(self) -> None:
        """Lets the robot's own sensors read, if it lives on them."""
        last, faults = (self._state, self._imu), self._faults
        self._truth, self._state, self._imu = None, None, None
        if faults.known and last[0] is not None and faults.loses(self.time, self._rng):
            self._state, self._imu = last
        elif self._senses is not None:
            given = [faults.broken] if faults.known else []
            self._state, self._imu = self._senses.sense(self.truth(), self._true_imu(), *given)

    def _true_imu(self) -> ImuSample:
        quaternion, gyro, accelerometer = self._sensed
        return ImuSample(quaternion[[1, 2, 3, 0]], gyro.copy(), accelerometer.copy())

    def _bind_kernels(self) -> None:
        """Binds the kernels of a tick and the arrays of MuJoCo's that they read and fill."""
        data, layout = self._data, self._layout
        places = np.array([layout.joint_q, layout.joint_v, layout.motors], dtype=np.int64)
        self._motors = (packed(self._motor), places, data.qpos, data.qvel, data.ctrl)
        self._sensed = [data.sensor(n).data for n in (ORIENTATION, GYRO, ACCELEROMETER)]
        state = (data.qpos, data.qvel, self._R_world_base)
        base = (layout.base_q.start, layout.base_v.start)
        self._read_joints = partial(read_joints, *state, *base, places)
        is_elliptic = bool(self._model.opt.cone == mujoco.mjtCone.mjCONE_ELLIPTIC)
        self._ground_forces = partial(ground_forces, data, layout.geom_codes, is_elliptic)
