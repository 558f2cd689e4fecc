"""What a trial depends on beside its seed: values, compared and stored by what they hold."""

from __future__ import annotations

from dataclasses import dataclass, field

from advise_ros.core.irl.settings import LearnSettings, SummedSettings, Terms
from advise_ros.core.people.simulated_demonstrator import Demonstrator
from advise_ros.core.people.simulated_expert import Expert
from advise_ros.experiments.recorded import Recorded


@dataclass(frozen=True)
class Method:
    """How a learner asks. None leaves a choice to the protocol of the domain.

    Attributes:
        name: as in the figures.
        clustering: 'k_means'; 'states' asks about each alone, 'ideal' knows the optimal actions.
        acquisition: of the learner, see `LearnSettings`; '' asks nothing.
        reading: of equation (1).
        clusters: k.
        features: weight of the states' structure beside the demonstrator's distribution.
        budget: questions.
        quality: of clusters, where `clustering` perturbs ideal ones.
    """

    name: str
    clustering: str = 'k_means'
    acquisition: str = 'paper'
    reading: str | None = None
    clusters: int | None = None
    features: float = 0.0
    budget: int | None = None
    quality: float = 1.0


@dataclass(frozen=True)
class Variant(Method):
    """A way to ask with more than the paper's choices.

    Attributes:
        temperature: of the Boltzmann policy; None: the protocol's.
        confirm: whether doubtful answers are asked for again.
    """

    temperature: float | None = None
    confirm: bool = False


# Figure 5's methods, and the order of clusters that Q5 asks about.
METHODS = {
    method.name: method
    for method in (
        Method('clustered'),
        Method('single', clustering='states'),
        Method('random', clustering='states', acquisition='random'),
        Method('trajectories', acquisition=''),
        Method('ideal', clustering='ideal'),
        Method('shuffled', acquisition='random'),
    )
}


@dataclass(frozen=True)
class Protocol:
    """A domain, its people and the learner's constants.

    Attributes:
        domain: name, an .npz file, or a dataset.
        demonstrator, expert: who shows and who answers.
        clusters: k of k-means.
        points: numbers of questions, ascending from 0, after which the policy is looked at.
        terms: constants and reading of equation (1).
        w_p: weight of F in U_s (definition 3).
        temperature: of the Boltzmann policy.
        laplace: added to each count.
        score: 'mean' (definition 4) or 'sum' (algorithm 1).
        solver: of equation (1), by name, so that a new default changes no figure.
    """

    domain: str
    demonstrator: Demonstrator | Recorded
    clusters: int
    points: tuple[int, ...] = tuple(range(11))
    expert: Expert = field(default_factory=lambda: Expert(prefer='plurality'))
    terms: Terms = field(default_factory=Terms)
    w_p: float = 1.0
    temperature: float = 1.0
    laplace: float = 0.1
    score: str = 'mean'
    solver: str = 'highs'

    @property
    def budget(self) -> int:
        """Questions in all."""
        return self.points[-1]

    def settings(self, method: Method, seed: int) -> LearnSettings:
        """The learner's settings for a method; `seed` is the trial's."""
        own = method if isinstance(method, Variant) else Variant('')
        terms = self.terms if method.reading is None else self.terms._replace(reading=method.reading)
        settings = SummedSettings if self.score == 'sum' else LearnSettings
        return settings(
            **terms._asdict(), clusters=self.clusters if method.clusters is None else method.clusters,
            cluster_features=method.features, laplace=self.laplace,
            temperature=self.temperature if own.temperature is None else own.temperature, w_p=self.w_p,
            acquisition=method.acquisition, confirm=own.confirm, seed=seed,
        )


@dataclass(frozen=True)
class OwnProtocol(Protocol):
    """The protocol of a user's files.

    Attributes:
        digest: of what they hold, so that results of earlier contents are not taken for theirs.
    """

    digest: str = ''
