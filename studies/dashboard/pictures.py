"""Pictures of a study's best trials, in its artifact store."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from optuna import Study, Trial
from optuna.artifacts import FileSystemArtifactStore, get_all_artifact_meta, upload_artifact
from optuna.trial import FrozenTrial

from pkm_gym.core.files import whole_file
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray

MECHANISM, INDEX_MAP = "mechanism.png", "index_map.png"
CARD = "Not drawn: a better design followed at once."


class Pictures:
    """Draws designs into the artifact store of a storage.

    A finished trial takes no new artifact and a drawing takes longer than hundreds of evaluations.
    So a new best trial is promised its pictures before it finishes: cards that say why there is no
    picture, replaced when ``draw`` is called for it.
    """

    def __init__(self, problem: DesignProblem, study: Study, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._problem = problem
        self._study = study
        self._folder = folder
        self._store = FileSystemArtifactStore(folder)

    def promise(self, trial: Trial | Study) -> None:
        """Give a running trial, or a study, its artifacts, to be drawn later."""
        with TemporaryDirectory() as folder:
            for name in (MECHANISM, INDEX_MAP):
                path = Path(folder) / name
                path.write_bytes(self._card)
                upload_artifact(
                    artifact_store=self._store,
                    file_path=str(path),
                    study_or_trial=trial,
                    storage=self._study._storage,
                )

    def draw(self, owner: FrozenTrial | Study, design: FloatArray) -> list[str]:
        """Draw a design into the artifacts of its trial or study; return their addresses."""
        from pkm_gym.plots import design_figure, index_map_figure, save

        makers: dict[str, Any] = {MECHANISM: design_figure, INDEX_MAP: index_map_figure}
        addresses = []
        with TemporaryDirectory() as folder:
            for meta in get_all_artifact_meta(owner, storage=self._study._storage):
                if meta.filename not in makers:
                    continue
                figure = makers[meta.filename](self._problem, design)
                drawn = save(figure, Path(folder) / meta.filename)
                with whole_file(self._folder / meta.artifact_id) as part:
                    part.write_bytes(drawn.read_bytes())
                addresses.append(self._address(owner, meta.artifact_id))
        return addresses

    def _address(self, owner: FrozenTrial | Study, artifact: str) -> str:
        own = "" if isinstance(owner, Study) else f"{owner._trial_id}/"
        return f"/artifacts/{self._study._study_id}/{own}{artifact}"

    @cached_property
    def _card(self) -> bytes:
        from pkm_gym.plots import new_figure, save

        figure = new_figure(4.0, 1.0)
        figure.text(0.5, 0.5, CARD, ha="center", va="center")
        with TemporaryDirectory() as folder:
            return save(figure, Path(folder) / "card.png").read_bytes()
