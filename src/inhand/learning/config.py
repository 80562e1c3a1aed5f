"""What is trained and how: one frozen configuration."""

from dataclasses import dataclass, field
from typing import Literal

from inhand.control.joint_network import NetworkKind
from inhand.hands.files import load_hand, load_object
from inhand.hands.spatial.pair import AnyPair, SpatialPair, load_held
from inhand.learning.recipe import SEEN, AnyRecording, Recipe, Recording, SpatialRecording
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.records import Config
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.names import ENGINE, Engine
from inhand.tasks.primitives import TRAIN


@dataclass(frozen=True)
class Learning(Config):
    """Numbers of the algorithm."""

    hidden: tuple[int, ...] = (128, 128)
    """Units of the hidden layers of actor and critic."""
    network: NetworkKind = "plain"
    """Form of the actor: plain, or joints, a graph network over the joints of any hand, which sees layout joints."""
    critics: int = 1
    """Number of critics; the smallest of their values is the target."""
    actor_rate: float = 1e-4
    """Learning rate of the actor (thesis 3.3.4)."""
    critic_rate: float = 1e-4
    """Learning rate of the critic (thesis 3.3.4)."""
    weight_decay: float = 1e-4
    """L2 regularisation of both networks (thesis 3.3.4)."""
    discount: float = 0.995
    """Discount for each decision (thesis 3.3.4)."""
    look_ahead: int = 5
    """Steps of the n-step return (thesis 3.3.4)."""
    reward_scale: float = 1.0
    """What rewards are multiplied by where values are learned."""
    n_step_weight: float = 1.0
    """Weight of the n-step loss (lambda_n)."""
    batch: int = 10
    """Rows of an update (thesis 3.3.4)."""
    follow: float = 0.005
    """Share by which target networks follow at each update."""
    smoothing: float = 0.0
    """Standard deviation of the noise on the target's action, cut at twice that."""
    actor_every: int = 1
    """Critic updates for each actor update."""
    imitation: float = 0.0
    """Weight of the imitation term (c)."""
    imitation_rate: float = 1e-3
    """Learning rate at which the actor is first fitted to the demonstrations."""
    value_weight: float = 0.0
    """Weight of the value term divided by the mean size of the values (q); 0 takes the values as they are."""
    prioritised: bool = False
    """Whether rows are drawn by priority, as in the DDPGfD paper."""


@dataclass(frozen=True)
class Training(Config):
    """A whole training run."""

    preset: str
    """What the run is called."""
    hand: str = "2v2_50.50_50.50_1.1_53"
    """Hand: a name of the laboratory's form or a TOML file."""
    object: str = "cube_39"
    """Object: a name, shape_SIZE in mm, a TOML file, or an outline in a CSV, SVG or DXF file with its unit and mass, as
    part.dxf:unit=mm:mass_kg=0.05."""
    engine: Engine = ENGINE
    """Physics engine: planar, mujoco (in three dimensions), or bullet as a witness (extra `bullet`; much slower)."""
    disturb: str = "none"
    """What disturbs worlds, senses and commands: none, bench, field, hard, or a TOML file. Demonstrations, the agent's
    episodes and evaluations each have worlds of their own; the expert and the actor see through the same senses."""
    pairs: int = 0
    """Pairs of a hand and an object to learn with, drawn of the family; 0 for the hand and the object above alone."""
    drawn: int = 96
    """Directions drawn on the sphere to plan grasps for beside named ones, and half as many axes; of hands in space."""
    start: str = ""
    """Policy whose weights training begins with: rl-family, or the folder of a run; by default they are drawn."""
    seed: int = 0
    """Seed of everything drawn."""
    directions: Literal["train", "continuous"] = "train"
    """train: the 8 of the Asterisk Test (thesis 3.1). continuous: half of the draws those 8, half anywhere on the
    circle but within `held_out` of the 8 unseen ones."""
    held_out: float = 5.0
    """Half width of the sectors about the unseen directions that continuous draws leave out [deg]."""
    task: str = ""
    """Whole task to train on end to end, instead of primitives: a task of `inhand trace`, or a drawing with its size in
    mm (square:60). Demonstrations then start where the task does: `midway`, `whole` and `grip_spread` do nothing."""
    interface: Interface = field(default_factory=Interface)
    """What the controller sees, does and is rewarded for."""
    recipe: Recipe = field(default_factory=Recipe)
    """How demonstrations are made."""
    demonstrations: str = ""
    """Folder of a dataset of `inhand record` to learn from; without it demonstrations are recorded by `recipe`."""
    noise: Noise = field(default_factory=Noise)
    """Noise of the starts."""
    learning: Learning = field(default_factory=Learning)
    """Numbers of the algorithm."""
    imitate: int = 0
    """Updates that fit the actor to the demonstrations before anything else, and to all that was relabelled at last."""
    rounds: int = 0
    """Rounds of relabelling after that (DAgger, Ross et al., 2011): the actor runs, the expert tells at every decision
    what it would do, and the actor is fitted to all there is."""
    relabelled: int = 512
    """Episodes of a round."""
    refit: int = 4000
    """Updates of a round but the last."""
    warm_up: int = 0
    """Updates of the critic on the demonstrations before the actor moves."""
    episodes: int = 20000
    """Episodes of the agent after which training ends (thesis 3.3.4); 0 to imitate alone."""
    agent_episodes: int = 10000
    """Episodes of the agent that the replay keeps at least (thesis 3.3.4)."""
    worlds: int = 100
    """Worlds that the agent acts in side by side."""
    decisions: int = 10
    """Decisions of every world in a round; a round's updates run meanwhile."""
    updates: int = 500
    """Updates in a round."""
    expert_share: float = 1.0
    """Share of a batch that comes from the expert at first."""
    share_kept: float = 0.8
    """What is left of that share after every `share_every` episodes: decayed by a factor of 0.2 (thesis 3.3.4)."""
    share_every: int = 1000
    """Episodes between two decays."""
    spread: float = 0.05
    """Standard deviation of the exploration noise on actions."""
    evaluate_every: int = 200
    """Episodes between two evaluations, each with a checkpoint (thesis 4.2)."""
    trials: int = 4
    """Starts of each direction in an evaluation."""

    @property
    def held(self) -> AnyPair:
        """The hand and the object, in the plane or in space."""
        return load_held(self.hand, self.object)

    @property
    def shows(self) -> AnyRecording:
        """What episodes are recorded by."""
        if not isinstance(held := self.held, SpatialPair):
            return self.recording
        told = self.recipe, self.interface, self.noise, self.seed, self.drawn, self.held_out
        return SpatialRecording(held, SEEN, *told, disturb=load_disturbance(self.disturb))

    @property
    def recording(self) -> Recording:
        """What demonstrations are to be recorded, or what they must have in common with a dataset's."""
        return Recording(
            load_hand(self.hand),
            load_object(self.object),
            tuple(each.angle_deg for each in TRAIN if each.angle_deg is not None),
            self.recipe,
            self.interface,
            self.noise,
            self.seed,
            self.engine,
            self.directions == "continuous",
            self.held_out,
            self.task,
            load_disturbance(self.disturb),
        )
