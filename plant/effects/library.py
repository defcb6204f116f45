"""Every effect that the bench knows; a new one is one file beside this and one line in it."""

from plant.effects.acceleration_limit import AccelerationLimit
from plant.effects.air_box_delay import AirBoxDelay
from plant.effects.air_density import AirDensity
from plant.effects.asymmetric_filling import AsymmetricFilling
from plant.effects.backlash import Backlash
from plant.effects.chain_polygon import ChainPolygon
from plant.effects.channel_lag import ChannelLag
from plant.effects.channel_latency import ChannelLatency
from plant.effects.channel_scale import ChannelScale
from plant.effects.clock_drift import ClockDrift
from plant.effects.clock_offset import ClockOffset
from plant.effects.closed_throttle_friction import ClosedThrottleFriction
from plant.effects.clutch_slip import ClutchSlip
from plant.effects.compression_torque import CompressionTorque
from plant.effects.crank_angle_delay import CrankAngleDelay
from plant.effects.direction_blind_counter import DirectionBlindCounter
from plant.effects.driveline_loss import DrivelineLoss
from plant.effects.eccentricity import Eccentricity
from plant.effects.effect import Effect
from plant.effects.firing_torque import FiringTorque
from plant.effects.fuel_film import FuelFilm
from plant.effects.gear_play import GearPlay
from plant.effects.grade import Grade
from plant.effects.grip_temperature import GripTemperature
from plant.effects.grip_wear import GripWear
from plant.effects.hardening_cush import HardeningCush
from plant.effects.held_frames import HeldFrames
from plant.effects.load_transfer import LoadTransfer
from plant.effects.mounting_angle import MountingAngle
from plant.effects.optical_lag import OpticalLag
from plant.effects.optical_scale import OpticalScale
from plant.effects.quantiser import Quantiser
from plant.effects.radius_growth import RadiusGrowth
from plant.effects.radius_with_lean import RadiusWithLean
from plant.effects.rate_limit import RateLimit
from plant.effects.relaxation_length import RelaxationLength
from plant.effects.runner_resonance import RunnerResonance
from plant.effects.slipper_clutch import SlipperClutch
from plant.effects.spark_clip import SparkClip
from plant.effects.spark_curvature import SparkCurvature
from plant.effects.spring_knee import SpringKnee
from plant.effects.squat import Squat
from plant.effects.stale_frames import StaleFrames
from plant.effects.throttle_stiction import ThrottleStiction
from plant.effects.tooth_misplacement import ToothMisplacement
from plant.effects.torque_dip import TorqueDip
from plant.effects.voltage_limit import VoltageLimit
from plant.effects.wet_patch import WetPatch
from plant.effects.wind import Wind

LIBRARY: tuple[type[Effect], ...] = (
    RateLimit,
    AccelerationLimit,
    VoltageLimit,
    ThrottleStiction,
    GearPlay,
    SpringKnee,
    AirBoxDelay,
    CrankAngleDelay,
    AsymmetricFilling,
    RunnerResonance,
    FuelFilm,
    ClosedThrottleFriction,
    AirDensity,
    SparkCurvature,
    SparkClip,
    TorqueDip,
    FiringTorque,
    CompressionTorque,
    ChainPolygon,
    Backlash,
    HardeningCush,
    ClutchSlip,
    SlipperClutch,
    DrivelineLoss,
    RadiusGrowth,
    RadiusWithLean,
    LoadTransfer,
    Squat,
    GripTemperature,
    GripWear,
    RelaxationLength,
    WetPatch,
    Grade,
    Wind,
    MountingAngle,
    OpticalScale,
    OpticalLag,
    ToothMisplacement,
    Eccentricity,
    ChannelLatency,
    ChannelLag,
    ChannelScale,
    DirectionBlindCounter,
    Quantiser,
    HeldFrames,
    StaleFrames,
    ClockOffset,
    ClockDrift,
)
"""Of effects at one seam the earlier acts first."""

BY_NAME = {effect.name: effect for effect in LIBRARY}
