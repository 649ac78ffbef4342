"""What a study's best trials carry as artifacts: pictures, the design's file, its model."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory

from optuna import Study, Trial
from optuna.artifacts import FileSystemArtifactStore, get_all_artifact_meta, upload_artifact
from optuna.trial import FrozenTrial

from pkm_gym.core.evaluation import Evaluation
from pkm_gym.core.problem import DesignProblem
from pkm_gym.core.types import FloatArray
from pkm_gym.studies.dashboard.promises import (
    DESIGN,
    MODEL,
    PICTURES,
    make,
    makers,
    promise,
)


class Pictures:
    """Puts artifacts of designs into the store of a storage: see ``promises``."""

    def __init__(self, problem: DesignProblem, study: Study, folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._problem = problem
        self._study = study
        self._folder = folder
        self._store = FileSystemArtifactStore(folder)
        self._found_by = str(study.user_attrs.get("command") or "pkm-gym search")

    def promise(self, owner: Trial | Study, best: Evaluation) -> None:
        """Promise a running trial, or a study, the artifacts of a design, evaluated alone."""
        design = best.designs[0]
        names = [*PICTURES, DESIGN]
        if best.feasible[0] and self._problem.mechanism(design).twin_module:
            names.append(MODEL)
        with TemporaryDirectory() as folder:
            for name in names:
                path = Path(folder) / name
                path.write_bytes(promise(name, self._problem, design, self._found_by))
                upload_artifact(
                    artifact_store=self._store,
                    file_path=str(path),
                    study_or_trial=owner,
                    storage=self._study._storage,
                )

    def draw(self, owner: FrozenTrial | Study, design: FloatArray) -> list[str]:
        """Make the artifacts of a trial or study at once; return its pictures' addresses."""
        addresses = []
        for meta in get_all_artifact_meta(owner, storage=self._study._storage):
            if meta.filename in makers():
                path = self._folder / meta.artifact_id
                make(meta.filename, self._problem, design, self._found_by, path)
            if meta.filename in PICTURES:
                addresses.append(self._address(owner, meta.artifact_id))
        return addresses

    def _address(self, owner: FrozenTrial | Study, artifact: str) -> str:
        own = "" if isinstance(owner, Study) else f"{owner._trial_id}/"
        return f"/artifacts/{self._study._study_id}/{own}{artifact}"
