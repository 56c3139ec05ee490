"""All constants of the 3D method in one record, and the compiled steps that read them."""
from dataclasses import dataclass, field
from functools import cached_property

from skeleton_extract_3d.body.body import BODY, BodyConstants
from skeleton_extract_3d.body.constants import FootConstants, SizeConstants
from skeleton_extract_3d.lift.constants import (
    CostConstants,
    DetachedConstants,
    HeadConstants,
    InferenceConstants,
    LandmarkConstants,
    MeasuringConstants,
    MonocularConstants,
    OccluderConstants,
    RegistrationConstants,
    TrunkConstants,
    WindowConstants,
)
from skeleton_extract_3d.points.constants import CameraFitConstants, PlausibilityConstants
from skeleton_extract_3d.track.constants import TrackConstants

try:
    import skeleton_extract_3d_lifting
except ImportError as error:
    raise ImportError(f'the compiled steps of skeleton_extract_3d are missing ({error}); build the workspace: ./run '
                      'setup, or catkin_make') from error


@dataclass(frozen=True, eq=False)
class MethodConstants:
    """The constants of each step of the method; every step takes this record, or the part that it needs."""

    body: BodyConstants = BODY
    camera_fit: CameraFitConstants = field(default_factory=CameraFitConstants)
    plausibility: PlausibilityConstants = field(default_factory=PlausibilityConstants)
    windows: WindowConstants = field(default_factory=WindowConstants)
    trunk: TrunkConstants = field(default_factory=TrunkConstants)
    costs: CostConstants = field(default_factory=CostConstants)
    occluders: OccluderConstants = field(default_factory=OccluderConstants)
    detached: DetachedConstants = field(default_factory=DetachedConstants)
    head: HeadConstants = field(default_factory=HeadConstants)
    inference: InferenceConstants = field(default_factory=InferenceConstants)
    registration: RegistrationConstants = field(default_factory=RegistrationConstants)
    landmarks: LandmarkConstants = field(default_factory=LandmarkConstants)
    monocular: MonocularConstants = field(default_factory=MonocularConstants)
    measuring: MeasuringConstants = field(default_factory=MeasuringConstants)
    sizes: SizeConstants = field(default_factory=SizeConstants)
    feet: FootConstants = field(default_factory=FootConstants)
    track: TrackConstants = field(default_factory=TrackConstants)

    @cached_property
    def compiled(self) -> skeleton_extract_3d_lifting.Method:
        """The compiled steps with these constants."""
        return skeleton_extract_3d_lifting.Method(self)


METHOD = MethodConstants()
