"""The exceptions of SceneSense. All derive from `SceneSenseError`; the message is for the user.

A message says what was wrong, where, and what to do about it.
"""


class SceneSenseError(Exception):
    """Base of every error that SceneSense raises on purpose."""


class MessageError(SceneSenseError):
    """A message cannot be encoded or decoded; the text names the JSON path."""


class ParameterError(SceneSenseError):
    """A parameter or command-line value is wrong; the text names it and the allowed range."""


class FrameError(SceneSenseError):
    """An image or a set of images does not make a usable RGB-D frame."""


class SimulationError(SceneSenseError):
    """A simulated scene cannot be built or rendered."""


class DatasetError(SceneSenseError):
    """A dataset on disk is damaged, incomplete or of another kind; the text names the file."""


class LanguageError(SceneSenseError):
    """Knowledge is written wrongly; one line per problem, `file:line:column` and the mend."""


class ReasoningError(SceneSenseError):
    """The logic program is missing or broken, or the solver failed on it."""


class WorkerError(SceneSenseError):
    """A worker process died, ran out of time, or could not be started."""


class StateError(SceneSenseError):
    """A state file on disk is damaged, of another version, or held by another process."""


class LaunchError(SceneSenseError):
    """The node graph could not be started or kept running."""


class ConversationError(SceneSenseError):
    """No node of a running graph listened or answered; the text says how to start one."""


class NetworkError(SceneSenseError):
    """A network cannot be trained, saved or read; the text says why, and what stays in use."""


class LearningError(SceneSenseError):
    """There is nothing to learn from, or what there is cannot be learned from."""


class BagError(SceneSenseError):
    """A bag cannot be written, read, repaired or played; the text names the bag and the mend."""
