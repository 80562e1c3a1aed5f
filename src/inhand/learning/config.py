"""What is trained and how: one frozen configuration, and the presets that return one."""

from dataclasses import dataclass, field, replace
from typing import Literal

from inhand.control.joint_network import NetworkKind
from inhand.errors import InputError
from inhand.hands.files import load_hand, load_object
from inhand.hands.spatial.pair import AnyPair, SpatialPair, load_held
from inhand.learning.recipe import SEEN, AnyRecording, Recipe, Recording, SpatialRecording
from inhand.learning.starts import Noise
from inhand.learning.worlds import Interface
from inhand.records import Config
from inhand.sim.disturbance_files import load_disturbance
from inhand.sim.names import ENGINE, SPATIAL, Engine
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


def thesis() -> Training:
    """Return the thesis's training (3.3.4); what it leaves open is numbered in docs/thesis.md."""
    return Training(
        "thesis",
        interface=Interface("thesis", "angles", "thesis", horizon=150),
        recipe=Recipe(episodes=5000, push=0.0, midway=0.0, grasp="rough"),
        learning=Learning(reward_scale=0.01, follow=1e-4),
        updates=250,
        expert_share=0.5,
        spread=0.02,
    )


def default() -> Training:
    """Return the training of a controller on real senses, in worlds that differ (docs/learning.md)."""
    base = privileged()
    return replace(
        base,
        preset="default",
        disturb="field",
        interface=Interface("senses", "steps", "progress", horizon=180, truth="truth"),
        recipe=Recipe(1536, "mild-teacher", 0.012, 0.25, "sensed", whole=0.5, grip_spread=8.0, turns=0.15, legs=0.35),
        imitate=10000,
        rounds=4,
        episodes=250,
        learning=replace(base.learning, imitation=4.0),
    )


def privileged() -> Training:
    """Return the training that goes farthest, on perfect knowledge; docs/learning.md argues what the thesis has not."""
    return Training(
        "privileged",
        directions="continuous",
        interface=Interface("grip", "steps", "progress", horizon=200),
        recipe=Recipe(episodes=2048, push=0.01, midway=0.5, whole=0.5, grip_spread=60.0),
        learning=Learning(
            critics=2,
            critic_rate=3e-4,
            weight_decay=1e-5,
            discount=0.99,
            batch=128,
            smoothing=0.1,
            actor_every=2,
            imitation=2.0,
            value_weight=0.3,
        ),
        imitate=12000,
        warm_up=3000,
        episodes=600,
        worlds=128,
        decisions=20,
        updates=250,
        expert_share=0.5,
        share_kept=1.0,
        evaluate_every=50,
    )


def family() -> Training:
    """Return the training of one controller on real senses for every hand and object of a family (docs/family.md)."""
    base = default()
    return replace(
        base,
        preset="family",
        pairs=96,
        interface=replace(base.interface, observation="joint-senses", truth="joints"),
        recipe=replace(base.recipe, expert="soft-teacher", turns=0.0, legs=0.0),
        imitate=6000,
        rounds=3,
        refit=3000,
        learning=replace(base.learning, network="joints", hidden=(64, 64)),
    )


def privileged_family() -> Training:
    """Return the same on perfect knowledge, which goes farther."""
    return replace(
        family(),
        preset="family-privileged",
        disturb="none",
        interface=Interface("joints", "steps", "progress", horizon=180),
        recipe=Recipe(1536, "teacher", push=0.012, midway=0.25, whole=0.5, grip_spread=60.0),
    )


def spatial() -> Training:
    """Return the training of one controller on real senses for a hand in space, by imitation (docs/spatial.md)."""
    base = replace(privileged_spatial(), preset="spatial", disturb="field", imitate=12000, rounds=4)
    senses = replace(base.interface, observation="space-senses", truth="space-truth")
    recipe = replace(base.recipe, push=0.012, grasp="sensed", palms=0.6)
    wide = replace(base.learning, hidden=(256, 256))
    return replace(base, interface=senses, recipe=recipe, learning=wide, warm_up=0, episodes=0)


def privileged_spatial() -> Training:
    """Return that of one controller for all directions and turns of a hand in space (docs/spatial.md)."""
    base = privileged()
    return replace(
        base,
        preset="spatial-privileged",
        hand="3f_60.60_40_10",
        object="cube_50",
        engine=SPATIAL,
        interface=Interface("space", "steps", "progress", horizon=180),
        recipe=Recipe(1536, "teacher", push=0.01, midway=0.25, whole=0.5, grip_spread=15.0),
        imitate=8000,
        rounds=3,
        warm_up=2000,
        episodes=250,
        trials=1,
        learning=replace(base.learning, imitation=4.0),
    )


def hand_of_family(given: Training | None = None) -> Training:
    """Return the training that fits a policy of the family to one hand and object, from few demonstrations."""
    base = given or family()
    return replace(
        base,
        preset="from-family",
        pairs=0,
        start="rl-family",
        recipe=replace(base.recipe, episodes=64, midway=0.0),
        learning=replace(base.learning, imitation_rate=2e-5),
        imitate=1000,
        refit=1000,
        rounds=1,
        relabelled=64,
        warm_up=0,
        updates=1,
        decisions=180,
        episodes=1,
        worlds=1,
        trials=4,
    )


def smoke() -> Training:
    """Return a training of seconds that goes through every part and learns little."""
    return Training(
        "smoke",
        interface=Interface("grip", "steps", "progress", horizon=25),
        recipe=Recipe(episodes=32, push=0.01, midway=0.0, grasp="rough"),
        learning=Learning(hidden=(16, 16), batch=16, imitation=1.0, reward_scale=0.01, follow=1e-4),
        imitate=2000,
        warm_up=1000,
        episodes=60,
        worlds=10,
        decisions=8,
        updates=20,
        expert_share=0.5,
        spread=0.02,
        evaluate_every=30,
        trials=1,
    )


PRESETS = {
    "default": default,
    "privileged": privileged,
    "family": family,
    "family-privileged": privileged_family,
    "from-family": hand_of_family,
    "spatial": spatial,
    "spatial-privileged": privileged_spatial,
    "thesis": thesis,
    "smoke": smoke,
}
"""Presets by name."""


def preset(name: str) -> Training:
    """Return a preset by name.

    Raises:
        InputError: there is none of that name.
    """
    if name not in PRESETS:
        was = "; what was sensed is default now, and what was default is privileged" if name == "sensed" else ""
        raise InputError(f"unknown preset {name!r}; allowed are {', '.join(PRESETS)}{was}")
    return PRESETS[name]()
