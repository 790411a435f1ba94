"""Plans the motion of soft things among soft things, and films it.

    import limber
    hulls = limber.decompose(vertices, faces, max_convex_hull=44)   # iterable of (vertices, faces)
    body = limber.prepare("bunny.obj", tets=1000)                   # hulls, cage, certificate, binding
    plan = limber.plan("barriers1", preset="fast", seed=1)
    plan.save("out"); limber.render("out"); limber.verify("out")

Arrays come in as anything numpy takes, and go out as float64, float32 and int32 that cannot be written to: what
they show is shared, not copied. Long calls leave the GIL alone, hear Ctrl-C, and tell `progress(stage, done,
total, note)` where one is given. What depends on a seed depends on nothing else: not on `threads`.
"""

from __future__ import annotations

import base64
import collections.abc
import functools
import inspect
import json
import operator
import os
import shutil
import signal
import subprocess
import tempfile
import threading
import warnings as _warnings
from html import escape as _escape
from typing import Any, Callable, Dict, List, NamedTuple, Optional, Sequence, Tuple, TypeVar, Union, cast

import numpy as np
from numpy.typing import NDArray

from . import _limber
from ._limber import (Binding, Body, Cage, Certificate, DiskError, InputError, InternalError, __version__,
                      push_dtype, scene_names)

__all__ = [
    "Binding", "Body", "Cage", "Certificate", "Decomposition", "DiskError", "Film", "Goal", "InputError",
    "InternalError", "Mesh", "Plan", "Prepared", "Promise", "Scene", "States", "World", "bind", "build_cage",
    "certify", "clean", "decompose",
    "export", "load_body", "load_mesh", "load_plan", "plan", "prepare", "prepare_many", "push_dtype", "pushes",
    "render", "report", "scene_names", "simulate", "verify", "__version__",
]

Path = Union[str, "os.PathLike[str]"]
Progress = Callable[[str, int, int, str], Any]
Array = NDArray[Any]
Hull = Tuple[Array, Array]
_F = TypeVar("_F", bound=Callable[..., Any])

_text = (str, os.PathLike)
_whole, _real, _bool = (int, np.integer), (int, float, np.integer, np.floating), (bool, np.bool_)
# What an annotation below takes, and how that is said.
_kinds_of_options: Dict[str, Tuple[Any, str]] = {
    "int": (_whole, "a whole number"), "Optional[int]": (_whole, "a whole number or None"),
    "float": (_real, "a number"), "Optional[float]": (_real, "a number or None"),
    "bool": (_bool, "True or False"), "str": (str, "a str"), "Path": (_text, "a path"),
    "Optional[Path]": (_text, "a path or None"),
    "Optional[Dict[str, Any]]": (dict, "a dict by keys of the scene file, or None"),
    "Optional[Progress]": (collections.abc.Callable, "a function of (stage, done, total, note), or None"),
    "Optional[Callable[[Plan], Any]]": (collections.abc.Callable, "a function of a Plan, or None"),
    "Sequence[Path]": ((*_text, list, tuple), "a path, or a list of them"),
}


def _checked(function: _F) -> _F:
    """Refuses an option of another kind than its annotation says by a TypeError that names it."""
    parameters = inspect.signature(function).parameters
    positional, told = list(parameters), function.__qualname__.replace(".__init__", "")

    @functools.wraps(function)
    def checked(*given: Any, **options: Any) -> Any:
        for name, value in [*zip(positional, given), *options.items()]:
            annotation = str(parameters[name].annotation) if name in parameters else ""
            kind, words = _kinds_of_options.get(annotation, (object, ""))
            if value is None and annotation.startswith("Optional"):
                continue
            if not isinstance(value, kind) or (isinstance(value, _bool) and kind in (_whole, _real)):
                raise TypeError(f"{told}: {name} is {value!r:.60}; it must be {words}")
            if kind is _whole and not -2**31 <= int(value) < (2**31 if annotation == "int" else 2**63):
                raise InputError(f"{name} is {value}, which is out of its range")
            if kind is _text and "\0" in str(value):
                raise InputError(f"{name} is {value!r}; a path has no NUL")
        return function(*given, **options)
    return cast(_F, checked)


def _list_of(paths: Any) -> List[Any]:
    """One, or several, as a list."""
    return [paths] if isinstance(paths, _text) else list(paths)


def _arrays_of(mesh: Any, faces: Any) -> Tuple[Any, Any]:
    """Vertices and faces: as they are, or of a Mesh, a Body, a trimesh.Trimesh, a pair."""
    if faces is not None:
        return mesh, faces
    if hasattr(mesh, "vertices") and hasattr(mesh, "faces"):
        return mesh.vertices, mesh.faces
    if isinstance(mesh, (tuple, list)) and len(mesh) == 2:
        return mesh[0], mesh[1]
    raise InputError("give vertices and faces, or what has both")


class Mesh(NamedTuple):
    vertices: Array  # (V, 3) float64, metres
    faces: Array     # (F, 3) int32, counter-clockwise seen from outside
    mended: List[str] = []    # what was done, as sentences
    warnings: List[str] = []  # what looks wrong


@_checked
def load_mesh(file: Path, *, scale: float = 1, y_up: bool = False, progress: Optional[Progress] = None) -> Mesh:
    """A model's surface, welded and oriented; OBJ, PLY, STL, OFF and what assimp reads."""
    return Mesh(*_limber.load_mesh(file, scale=scale, y_up=y_up, progress=progress))


@_checked
def clean(vertices: Any, faces: Any = None, *, progress: Optional[Progress] = None) -> Mesh:
    """A mesh in memory, welded and oriented as load_mesh() does it."""
    return Mesh(*_limber.clean(*_arrays_of(vertices, faces), progress=progress))


class Decomposition(Sequence[Hull]):
    """Convex hulls that cover a model: a sequence of (vertices, faces)."""

    def __init__(self, told: Dict[str, Any]):
        self.hulls: List[Hull] = told["hulls"]
        self.neighbours: Array = told["neighbours"]          # (n, 2): hulls that share a cut
        self.stopped_by: str = told["stopped_by"]                 # "count", "concavity", "gain", "exact"
        self.mean_overshoot: float = told["mean_overshoot"]       # over the model's diagonal
        self.max_overshoot: float = told["max_overshoot"]
        self.vertices_uncovered: int = told["vertices_uncovered"]    # exact
        self.triangles_uncovered: int = told["triangles_uncovered"]  # exact

    def __len__(self) -> int:
        return len(self.hulls)

    def __getitem__(self, i):  # type: ignore[no-untyped-def]
        return self.hulls[i]

    def __repr__(self) -> str:
        return (f"<limber.Decomposition: {len(self)} hulls, overshoot mean {100 * self.mean_overshoot:.3f} %, "
                f"largest {100 * self.max_overshoot:.3f} % of the diagonal>")


@_checked
def decompose(vertices: Any, faces: Any = None, *, max_convex_hull: int = 32, threshold: float = 0, concavity: float = 0,
              max_hull_vertices: int = 64, inflate: float = 0, exact: bool = False,
              progress: Optional[Progress] = None, threads: int = 0) -> Decomposition:
    """A model as a union of few convex hulls: decompose(vertices, faces), or of a mesh that has both.

    `threshold` is CoACD's concavity; 0: only the count rules. max_convex_hull = -1: as many as the threshold takes.
    """
    if max_convex_hull == -1:
        if not (threshold > 0 or concavity > 0):
            raise InputError("max_convex_hull is -1, no limit: threshold or concavity must be above 0")
        max_convex_hull = 1000
    return Decomposition(_limber.decompose(
        *_arrays_of(vertices, faces), max_convex_hull=max_convex_hull, threshold=threshold, concavity=concavity,
        max_hull_vertices=max_hull_vertices, inflate=inflate, exact=exact, progress=progress, threads=threads))


@_checked
def build_cage(vertices: Any, faces: Any = None, hulls: Sequence[Hull] = (), *, tets: int = 1000, mode: str = "lattice",
               progress: Optional[Progress] = None, threads: int = 0) -> Cage:
    """A coarse tetrahedral mesh that encloses the surface. Modes: lattice, fast, paper (needs hulls), conform."""
    return _limber.build_cage(*_arrays_of(vertices, faces), list(hulls), tets=tets, mode=mode, progress=progress, threads=threads)


def _require_cage(cage: Any, name: str) -> Cage:
    if not isinstance(cage, Cage):
        raise TypeError(f"{name}: cage is {cage!r:.60}; it must be a Cage")
    return cage


def certify(vertices: Any, faces: Any = None, cage: Optional[Cage] = None) -> Certificate:
    """Whether the cage encloses the surface: proved with exact arithmetic, from the two alone."""
    return _limber.certify(*_arrays_of(vertices, faces), _require_cage(cage, "certify"))


def bind(vertices: Any, faces: Any = None, cage: Optional[Cage] = None) -> Binding:
    """Barycentric weights of the surface in the cage."""
    return _limber.bind(*_arrays_of(vertices, faces), _require_cage(cage, "bind"))


@_checked
def prepare(model: Any, faces: Any = None, *, shells: int = 32, concavity: float = 0, threshold: float = 0,
            inflate: float = 0, max_hull_vertices: int = 64, exact: bool = False, tets: int = 1000,
            mode: str = "lattice", scale: float = 1, y_up: bool = False, progress: Optional[Progress] = None,
            threads: int = 0) -> Body:
    """Hulls, cage, certificate and binding of a model: prepare("bunny.obj"), prepare(vertices, faces) or prepare(mesh).

    `scale`: metres a unit; `y_up`: +Y is up in what is given, as +Z is here; of files and arrays alike.

    The surface may get vertices: edges longer than the cage's tets are cut, so that it bends as the cage does.
    """
    if faces is None and not isinstance(model, _text):
        model, faces = _arrays_of(model, faces)
    if isinstance(model, _text) and "\0" in str(model):
        raise InputError(f"model is {model!r}; a path has no NUL")
    if faces is not None and (scale != 1 or y_up):
        if not 0 < scale < float("inf"):
            raise InputError(f"scale is {scale}; it must be above 0")
        model = scale * np.asarray(model, dtype=np.float64)
        if y_up and model.ndim == 2 and model.shape[1] == 3:
            model = np.stack([model[:, 0], -model[:, 2], model[:, 1]], axis=1)
    return _limber.prepare(model, faces, shells=shells, concavity=concavity, threshold=threshold, inflate=inflate,
                           max_hull_vertices=max_hull_vertices, exact=exact, tets=tets, mode=mode, scale=scale,
                           y_up=y_up, progress=progress, threads=threads)


@_checked
def load_body(folder: Path) -> Body:
    """What Body.save, or `limber prepare`, has written."""
    return Body.load(folder)


def _table(rows: Dict[str, str]) -> str:
    return "<table>" + "".join(
        f"<tr><th style='text-align:left'>{_escape(name)}</th><td style='text-align:left'>{_escape(text)}</td></tr>"
        for name, text in rows.items()) + "</table>"


def _html_of_body(body: Body) -> str:
    certificate = body.certificate
    rows = {"surface": f"{len(body.vertices)} vertices, {len(body.faces)} triangles",
            "hulls": str(len(body.hulls)),
            "cage": f"{len(body.cage.tets)} tets, {len(body.cage.vertices)} nodes, dihedrals "
                    f"{certificate.min_dihedral_deg:.1f} … {certificate.max_dihedral_deg:.1f} degrees",
            "certificate": "holds" if certificate.holds else
                           f"does not hold: {certificate.vertices_outside} vertices outside, "
                           f"{certificate.triangles_crossing} triangles cross",
            "binding": f"{body.binding.outside} vertices outside their tets"}
    picture = base64.b64encode(body.picture_png()).decode()
    return _table(rows) + f"<img alt='the cage over the surface' src='data:image/png;base64,{picture}'>"


Body._repr_html_ = _html_of_body  # type: ignore[attr-defined]
def _shows(words: Callable[[Any], str]) -> Callable[[Any], str]:
    def __repr__(self: Any) -> str:
        return f"<limber.{type(self).__name__}: {words(self)}>"
    return __repr__


for _named, _words in (
        (Body, lambda body: f"{len(body.vertices)} vertices, {len(body.hulls)} hulls, {len(body.cage.tets)} tets"),
        (Cage, lambda cage: f"{len(cage.tets)} tets, {len(cage.vertices)} nodes"),
        (Binding, lambda bound: f"{len(bound.weights)} vertices, {bound.outside} of them outside"),
        (Certificate, lambda told: "holds" if told.holds else
         f"{told.vertices_outside} vertices outside, {told.triangles_crossing} triangles cross")):
    setattr(_named, "__repr__", _shows(_words))


class Prepared(NamedTuple):
    """A model of many: a body, or why there is none."""
    name: str                # of its folder in the batch
    source: str              # the model's file
    folder: Optional[str]    # of the body, for load_body; None where there is none
    reason: str              # "", "refused", "time", "memory", "crash", "defect"
    message: str
    figures: Dict[str, Any]  # its row of manifest.jsonl


@_checked
def prepare_many(models: Union[Path, Sequence[Path]], out: Path, *, jobs: int = 0, time_limit: float = 600,
                 memory_limit: Optional[float] = None, retry_failed: bool = False, store: Path = "",
                 shells: int = 32, concavity: float = 0, threshold: float = 0, inflate: float = 0,
                 max_hull_vertices: int = 64, exact: bool = False, tets: int = 1000, mode: str = "lattice",
                 scale: float = 1, y_up: bool = False, program: Path = "",
                 progress: Optional[Progress] = None, threads: int = 0) -> List[Prepared]:
    """Bodies of many models, files and folders, in the folder `out`, where they are found again.

    As `limber prepare` does it, whose program this calls: each in a process of its own, with an end to its CPU
    time (seconds) and memory (MB); one that hangs, crashes or is no model is told of, and the others go on.
    `program`: the one on the PATH, or else that which was installed or built with this module.
    """
    words = [os.fspath(program) or _program(), "prepare"]
    with tempfile.TemporaryDirectory() as lists:
        # Files go in lists: there may be more of them than a command line holds.
        listed: List[bytes] = []

        def end_list() -> None:
            if listed:
                name = os.path.join(lists, f"{len(words)}.txt")
                with open(name, "wb") as file:
                    file.write(b"\0".join(listed) + b"\0")
                words.append("@" + name)
                listed.clear()
        for model in [models] if isinstance(models, (str, os.PathLike)) else models:
            where = os.path.abspath(os.fspath(model))
            if os.path.isdir(where):
                end_list()
                words.append(where)
            else:
                listed.append(os.fsencode(where))
        end_list()
        if len(words) == 2:
            raise InputError("prepare_many: there is no model")
        told: Dict[str, Any] = {"--jobs": jobs, "--time-limit": time_limit, "--shells": shells,
                                "--concavity": concavity, "--inflate": inflate,
                                "--max-hull-vertices": max_hull_vertices, "--tets": tets, "--mode": mode,
                                "--scale": scale, "--threads": threads}
        if threshold:
            told["--threshold"] = threshold
        if memory_limit is not None:
            told["--memory-limit"] = memory_limit
        if os.fspath(store):
            told["--store"] = os.fspath(store)
        for name, value in told.items():
            words += [name, str(value)]
        words += [flag for flag, wanted in (("--exact", exact), ("--y-up", y_up), ("--retry-failed", retry_failed))
                  if wanted]
        said = _run(words + ["-o", os.fspath(out)], progress)
    with open(said["manifest"], encoding="utf-8") as file:
        rows = [json.loads(line) for line in file]
    return [Prepared(row["name"], row["source"],
                     os.path.join(os.fspath(out), row["folder"]) if row["status"] == "done" else None,
                     row.get("reason", ""), row.get("message", ""), row) for row in rows]


def _program() -> str:
    """On the PATH, else <prefix>/bin of <prefix>/lib/python3/dist-packages/limber, else that of the build."""
    here = os.path.dirname(os.path.abspath(__file__))
    known = [os.path.join(here, *([".."] * 4), "bin", "limber"), os.path.join(here, "..", "..", "cli", "limber")]
    return next((path for path in known if os.access(path, os.X_OK)),
                "limber") if shutil.which("limber") is None else "limber"


def _run(words: List[str], progress: Optional[Progress]) -> Dict[str, Any]:
    """What the command says with --json; its errors as ours."""
    try:
        version = subprocess.run([words[0], "--version"], capture_output=True, text=True, check=True).stdout.split()
    except (OSError, subprocess.CalledProcessError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(f"{words[0]}: cannot be run ({why}); install the program limber, or name it by program=")
    if version != ["limber", __version__]:
        raise InputError(f"{words[0]}: is {' '.join(version)}, and this is limber {__version__}; "
                         "name another by program=")
    process = subprocess.Popen(words + ["--json", "--progress", "json"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                               encoding="utf-8", start_new_session=True)
    assert process.stdout and process.stderr
    out: List[str] = []
    reader = threading.Thread(target=lambda: out.append(process.stdout.read()))  # type: ignore[union-attr]
    reader.start()
    try:
        for line in process.stderr:
            event = json.loads(line) if line.startswith("{") else {}
            if event.get("event") == "warning":
                _warnings.warn(event["text"], UserWarning, stacklevel=4)
            elif event.get("event") == "model" and progress is not None:
                progress("prepare", event["done"], event["total"], event["name"])
    except BaseException:
        process.send_signal(signal.SIGTERM)
        raise
    finally:
        code = process.wait()
        reader.join()
        process.stdout.close()
        process.stderr.close()
    if code in (0, 6):
        return json.loads(out[0])  # type: ignore[no-any-return]
    what = json.loads(out[0]).get("error", "") if out[0].startswith("{") else f"ended with {code}"
    raise {2: InputError, 5: DiskError}.get(code, InternalError)(what)


# ---- Scenes and motions

class Goal(NamedTuple):
    """Where the robot's centre of mass is to get."""
    center_of_mass_m: Array  # (3,)
    radius_m: float


class Scene:
    """A scene file, or the name of a scene that comes with limber.

    `set` edits it before it is read, by the keys of the scene file: {"planner.max_force_n": 30}.
    """

    @_checked
    def __init__(self, file_or_name: Path, *, preset: str = "", set: Optional[Dict[str, Any]] = None,
                 data: Sequence[Path] = ()):
        self._keep(_limber.Scene(os.fspath(file_or_name), preset=preset, sets=_edits(set), data=_list_of(data)))

    def _keep(self, scene: "_limber.Scene") -> None:
        self._scene = scene
        self.name: str = self._scene.name
        self.text: str = self._scene.text
        self.bodies: List[str] = self._scene.bodies
        self.robot: str = self._scene.robot

    @property
    def goal(self) -> Optional[Goal]:
        """None where the scene can only be simulated. A goal may ask more, and may move (docs/scene.md)."""
        goal = self._scene.goal
        return None if goal is None else Goal(np.array(goal[0]), goal[1])

    @property
    def max_force_n(self) -> float:
        """That the planner may push the robot with."""
        return self._scene.max_force_n

    def __repr__(self) -> str:
        return f"<limber.Scene {self.name}: {', '.join(self.bodies)}>"


def _edits(given: Optional[Dict[str, Any]]) -> List[str]:
    """{"planner.seed": 3} and {"planner": {"seed": 3}} alike."""
    edits = []
    for key, value in (given or {}).items():
        if value is None:
            raise InputError(f"set: {key} is None; leave it out")
        if isinstance(value, dict):
            edits += [f"{key}.{edit}" for edit in _edits(value)]
        else:
            edits.append(f"{key}={_toml(value)}")
    return edits


def _toml(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return value
    if isinstance(value, (int, float, np.number)):
        return repr(value.item() if isinstance(value, np.number) else value)
    return "[" + ", ".join(json.dumps(v) if isinstance(v, str) else _toml(v) for v in value) + "]"


class States(NamedTuple):
    """States of a world, one a row; time = steps × World.dt_s."""
    positions: Array   # (B, N, 3) float32, metres
    velocities: Array  # (B, N, 3) float32, metres a second
    steps: Array       # (B,) int64
    sound: Array       # (B,) bool; False: the dynamics diverged, now or before, and the state means nothing

    def take(self, rows: Any) -> States:
        """Some of them, by number, slice or mask: states.take([3] * 64), states.take(states.sound)."""
        picked = [np.atleast_1d(rows)] if not isinstance(rows, slice) else [rows]
        return States(*(column[picked[0]] for column in self))

    @staticmethod
    def join(several: Sequence[States]) -> States:
        """One row after the other."""
        return States(*(np.concatenate(columns) for columns in zip(*several)))


_kinds = ("none", "body", "control_point", "interpolation", "hold")


@_checked
def pushes(count: int, kind: str = "body", *, steps: Any, force_n: Any = 0, node: Any = -1, radius_m: Any = 0,
           target_m: Any = 0, max_force_n: Any = 0, second_node: Any = -1, second_force_n: Any = 0,
           pressure_pa: Any = 0) -> Array:
    """`count` pushes of the robot, as rows of push_dtype; each argument is one for all, or one a push.

    "body": force_n on the whole robot. "control_point": the same near `node` alone, within radius_m,
    and, where second_node is none of -1, at the same time second_force_n near that.
    "interpolation", "hold": towards target_m with at most max_force_n. Of any kind: pressure_pa blows a
    soft robot up meanwhile. Held for `steps` time steps.
    Forces and targets are (3,) or (count, 3).
    """
    if kind not in _kinds:
        raise InputError(f"kind is {kind!r}; it must be one of {', '.join(_kinds)}")
    if count < 0:
        raise InputError(f"count is {count}; it must not be negative")
    for name, value in (("steps", steps), ("node", node), ("second_node", second_node)):
        whole = np.asarray(value)
        if whole.dtype.kind not in "iu" or (whole.size and not -2**31 <= int(whole.min()) <= int(whole.max()) < 2**31):
            raise InputError(f"{name} must be whole numbers below 2**31, not {value!r:.60}")
        if whole.shape not in ((), (1,), (count,)):
            raise InputError(f"{name} has the shape {whole.shape}; it must be () or {(count,)}")
    if np.size(steps) and np.min(steps) < 1:
        raise InputError(f"steps is {np.min(steps)}; it must be above 0")
    for name, value in (("force_n", force_n), ("radius_m", radius_m), ("target_m", target_m),
                        ("max_force_n", max_force_n), ("second_force_n", second_force_n), ("pressure_pa", pressure_pa)):
        try:
            finite = bool(np.isfinite(np.asarray(value, dtype=np.float32)).all())
        except (TypeError, ValueError):
            finite = False
        if not finite:
            raise InputError(f"{name} must be numbers that are finite in float32, not {value!r:.60}")
        shape, wanted = np.shape(value), [(), (1,), (count,)]
        if name in ("force_n", "target_m", "second_force_n"):
            wanted = [(3,), (1, 3), (count, 3)]
        if shape not in wanted and not (shape == () and value == 0):
            raise InputError(f"{name} has the shape {shape}; it must be {wanted[0]} or {wanted[-1]}")
    made = np.zeros(count, push_dtype)
    made["kind"] = _kinds.index(kind)
    made["steps"], made["force_n"], made["node"] = steps, force_n, node
    made["radius_m"], made["target_m"], made["max_force_n"] = radius_m, target_m, max_force_n
    made["second_node"], made["second_force_n"] = second_node, second_force_n
    made["pressure_pa"] = pressure_pa
    return made


class World:
    """A scene's bodies, ready to be stepped. Without a work folder bodies are prepared in a temporary one."""

    @_checked
    def __init__(self, scene: Union[Scene, Path], work_folder: Path = "", *, preset: str = "",
                 set: Optional[Dict[str, Any]] = None, data: Sequence[Path] = (),
                 progress: Optional[Progress] = None, threads: int = 0):
        self.scene = _scene_of(scene, preset, set, data)
        self._world = _limber.World(self.scene._scene, work_folder, progress=progress, threads=threads)

    @classmethod
    def _of(cls, world: "_limber.World") -> World:
        scene, made = Scene.__new__(Scene), cls.__new__(cls)
        scene._keep(world.scene)
        made.scene, made._world = scene, world
        return made

    @property
    def bodies(self) -> Dict[str, Body]:
        """By name."""
        return dict(zip(self.scene.bodies, self._world.bodies))

    @property
    def dt_s(self) -> float:
        """Of a time step, seconds."""
        return self._world.dt_s

    def __repr__(self) -> str:
        return f"<limber.World {self.scene.name}: {self.nodes} nodes that move, dt {1e3 * self.dt_s:.3g} ms>"

    @property
    def nodes(self) -> int:
        """Of all bodies that move: rows of States.positions."""
        return self._world.nodes

    def nodes_of(self, body: str) -> slice:
        """The rows of a body among States.positions; empty for one that does not move."""
        first, count = self._world.nodes_of(_index(body, self.scene.bodies))
        return slice(first, first + count)

    @_checked
    def start(self, copies: int = 1) -> States:
        """The scene's start, so many times."""
        return States(*self._world.start(copies))

    @_checked
    def rollout(self, states: States, pushes: Array, *, threads: int = 0) -> States:
        """Where each state is led by the push of its row. A result depends on its state and push alone.

        States say nothing of which world they are: another with as many nodes takes them.
        """
        states = _states_of(states)
        if not isinstance(pushes, np.ndarray):
            raise TypeError(f"rollout: pushes is {pushes!r:.60}; pushes() makes them")
        return States(*self._world.rollout(states.positions, states.velocities, states.steps, states.sound, pushes,
                                           threads=threads))

    def robot_centers(self, states: States) -> Array:
        """(B, 3) centres of mass of the robot, metres."""
        states = _states_of(states)
        return self._world.robot_centers(states.positions, states.velocities, states.steps, states.sound)

    @_checked
    def plan(self, *, seed: Optional[int] = None, iterations: Optional[int] = None,
             time_limit: float = float("inf"), shortcut: Optional[int] = None, cost: str = "duration",
             improve: bool = False, resume: Optional[Plan] = None,
             keep: Optional[Callable[[Plan], Any]] = None, progress: Optional[Progress] = None,
             threads: int = 0) -> Plan:
        """As `limber plan` with the same options: the same bytes. None: the scene's.

        `resume`: the plan to go on from. `keep` gets the plan so far where Ctrl-C, or what `progress` raises,
        ends the search.
        """
        if resume is not None and not isinstance(resume, Plan):
            raise TypeError(f"plan: resume is {resume!r:.60}; it must be a Plan or None")
        def keep_so_far(found: "_limber.Plan") -> None:
            if keep is not None:
                keep(Plan(found, self))
        return Plan(self._world.plan(seed=seed, iterations=iterations, time_limit_s=time_limit,
                                     shortcut_rounds=shortcut, cost=cost, improve=improve,
                                     earlier=None if resume is None else resume._plan,
                                     keep=keep_so_far,
                                     progress=progress, threads=threads), self)

    @_checked
    def simulate(self, duration: float = 5, *, progress: Optional[Progress] = None, threads: int = 0) -> Plan:
        """The scene left to itself, as `limber simulate`; seconds."""
        return Plan(self._world.simulate(duration, progress=progress, threads=threads), self)


def _states_of(given: Any) -> States:
    if not isinstance(given, tuple) or len(given) != 4:
        raise TypeError("states must be States, as start() and rollout() give them")
    for name, array, kinds in (("steps", given[2], "iu"), ("sound", given[3], "b")):
        if np.asarray(array).dtype.kind not in kinds:
            raise InputError(f"states: {name} must be {'whole numbers' if name == 'steps' else 'True or False'}, "
                             f"not {array!r:.60}")
    return States(*given)


def _index(name: str, names: Sequence[str]) -> int:
    if name not in names:
        raise InputError(f"there is no body {name!r}; there are {', '.join(names)}")
    return names.index(name)


class Plan:
    """A motion that was planned or simulated."""

    def __init__(self, plan: "_limber.Plan", world: Optional[World] = None):
        self._plan = plan
        self._world = world
        self._bodies: List[str] = plan.world.scene.bodies
        self.solved: bool = plan.solved
        self.why: str = plan.explanation
        self.iterations: int = plan.iterations
        self.duration_s: float = plan.duration_s
        self.frames_per_second: float = plan.frames_per_second
        self.tree_hash: str = plan.tree_hash
        self.trajectory_hash: str = plan.trajectory_hash
        self._states: Optional[States] = None

    @property
    def world(self) -> World:
        """The one that it was planned in."""
        if self._world is None:
            self._world = World._of(self._plan.world)
        return self._world

    @property
    def states(self) -> States:
        """One a frame."""
        if self._states is None:
            self._states = States(*self._plan.states())
        return self._states

    @property
    def frames(self) -> Array:
        """(f, N, 3) positions of the nodes of all bodies that move."""
        return self.states.positions

    @property
    def pushes(self) -> Array:
        """From the start, rows of push_dtype."""
        return self._plan.pushes

    @_checked
    def surface(self, body: str, frame: int) -> Array:
        """(V, 3) of the fine surface; a negative frame counts from the last."""
        count = self._plan.frame_count
        if not -count <= frame < count:
            raise InputError(f"there is no frame {frame}; they are 0 … {count - 1}, or from -{count} on from the last")
        return self._plan.surface(_index(body, self._bodies), frame + count if frame < 0 else frame)

    def faces(self, body: str) -> Array:
        """(F, 3) of the fine surface, rows of surface()."""
        return self._plan.world.bodies[_index(body, self._bodies)].faces

    @property
    def summary(self) -> Dict[str, Any]:
        """What `limber plan --json` prints."""
        return json.loads(self._plan.summary_json())  # type: ignore[no-any-return]

    def save(self, folder: Path, *, keep_tree: str = "all") -> None:
        """plan.npz and all that `limber plan -o` leaves in a work folder, bodies included.

        `keep_tree`: all nodes of the tree, or those of the "path" alone, where the search is finished; then no search
        goes on from it.
        """
        self._plan.save(folder, keep_tree=keep_tree)

    def __len__(self) -> int:
        return self._plan.frame_count

    def __repr__(self) -> str:
        return f"<limber.Plan: {len(self)} frames, {self.duration_s:.2f} s. {self.why}>"

    def _repr_html_(self) -> str:
        figures = self.summary
        rows = {"result": self.why, "motion": f"{self.duration_s:.2f} s in {len(self)} frames",
                "iterations": str(self.iterations)}
        if "largest_volume_change_percent" in figures:
            rows["volume"] = "changes at most: " + ", ".join(
                f"{name} {percent:.2f} %" for name, percent in figures["largest_volume_change_percent"].items())
            rows["penetration"] = (f"at most {100 * figures['deepest_penetration_of_robot_size']:.2f} % of the robot's "
                                   f"size ({figures['penetration_between']})")
            rows["strain"] = f"at most {figures['largest_strain']:.3f} ({figures['largest_strain_of']})"
            rows["contact"] = f"at most {figures['largest_contact_force_n']:.1f} N ({figures['contact_between']})"
        rows.update({"tree": self.tree_hash, "trajectory": self.trajectory_hash})
        return _table(rows)


def _scene_of(scene: Union[Scene, Path], preset: str, set: Optional[Dict[str, Any]], data: Sequence[Path]) -> Scene:
    if not isinstance(scene, Scene):
        return Scene(scene, preset=preset, set=set, data=data)
    if preset or set or data:
        raise InputError("preset, set and data are of the scene; give them to Scene(…)")
    return scene


@_checked
def plan(scene: Union[Scene, Path], out: Optional[Path] = None, *, preset: str = "",
         set: Optional[Dict[str, Any]] = None, data: Sequence[Path] = (), seed: Optional[int] = None,
         iterations: Optional[int] = None, time_limit: float = float("inf"), shortcut: Optional[int] = None,
         cost: str = "duration", improve: bool = False, resume: bool = False, keep_tree: str = "all",
         progress: Optional[Progress] = None, threads: int = 0) -> Plan:
    """Plans a scene; with `out` in a work folder, where its bodies are kept and the plan is saved.

    `keep_tree` as of Plan.save; what is returned has the whole tree.

    A search that Ctrl-C ends is saved there, too, and `resume` goes on from it; of one that has not begun (bodies
    are prepared first) there is nothing to resume.
    """
    if keep_tree not in ("all", "path"):  # now: the search would be lost
        raise InputError(f"keep_tree is {keep_tree!r}; it must be all or path")
    if resume and out is None:
        raise InputError("resume goes on from the plan in the folder `out`, and none is named")
    if resume and out is not None and not os.path.exists(os.path.join(out, "plan.npz")):
        raise InputError(f"{os.fspath(out)}: has no plan to go on from; leave resume out")
    scene = _scene_of(scene, preset, set, data)
    world = World(scene, "" if out is None else out, progress=progress, threads=threads)
    found = world.plan(seed=seed, iterations=iterations, time_limit=time_limit, shortcut=shortcut, cost=cost,
                       improve=improve, resume=load_plan(out) if resume and out is not None else None,
                       keep=lambda so_far: None if out is None else so_far.save(out), progress=progress,
                       threads=threads)
    if out is not None:
        found.save(out, keep_tree=keep_tree)
    return found


@_checked
def simulate(scene: Union[Scene, Path], out: Optional[Path] = None, *, duration: float = 5, preset: str = "",
             set: Optional[Dict[str, Any]] = None, data: Sequence[Path] = (), progress: Optional[Progress] = None,
             threads: int = 0) -> Plan:
    """The scene left to itself, no search; seconds. `out` as of plan()."""
    scene = _scene_of(scene, preset, set, data)
    world = World(scene, "" if out is None else out, progress=progress, threads=threads)
    found = world.simulate(duration, progress=progress, threads=threads)
    if out is not None:
        found.save(out)
    return found


@_checked
def load_plan(folder: Path) -> Plan:
    """What Plan.save, or `limber plan`, has written."""
    return Plan(_limber.Plan.load(folder))


# ---- Work folders

class Promise(NamedTuple):
    name: str
    kept: bool
    value: str


@_checked
def verify(folder: Path, *, scene: Union[Scene, Path] = "", preset: str = "", set: Optional[Dict[str, Any]] = None,
           data: Sequence[Path] = (), model: Path = "", progress: Optional[Progress] = None,
           threads: int = 0) -> List[Promise]:
    """Every promise that limber makes of a work folder, or of a body's, checked anew from its files.

    Of a plan all is replayed and searched again, which takes as long as the search did. `scene`, with preset, set and
    data as of plan(): the one that the plan must be of; `model`: the file that the body must be of.
    """
    if scene and model:
        raise InputError("verify: scene is of a plan's folder, model of a body's: give one of them")
    if not scene and (preset or set or data):
        raise InputError("verify: preset, set and data are of a scene, and none is named")
    named = _scene_of(scene, preset, set, data)._scene if scene else None
    return [Promise(*row) for row in
            _limber.verify(folder, scene=named, model=model, progress=progress, threads=threads)]


class Film(NamedTuple):
    """A film has other frames than its motion: its speed, its pace and what stands still make more or fewer."""
    video: Optional[str]  # None where not every frame is there
    frames_painted: int   # of the film, now: with resume those that were right already are not among them
    frames_failed: int


@_checked
def render(folder: Path, *, size: Optional[Tuple[int, int]] = None, frames: str = "", camera: str = "main",
           name: str = "", set: Optional[Dict[str, Any]] = None, video: Path = "", resume: bool = False,
           progress: Optional[Progress] = None, threads: int = 0) -> Film:
    """Frames, and the film of them, without a display. `frames`, "0-9,20-40:5", count the film's."""
    try:
        width, height = (0, 0) if size is None else (operator.index(size[0]), operator.index(size[1]))
        if size is not None and (len(size) != 2 or not 0 < min(width, height) <= max(width, height) < 2**31):
            raise ValueError
    except (TypeError, ValueError, IndexError, KeyError):
        raise TypeError(f"render: size is {size!r:.60}; it must be (width, height) in pixels") from None
    film, painted, failed = _limber.render(
        folder, width=width, height=height, frames=frames, camera=camera, name=name,
        sets=_edits(set), video=video, resume=resume,
        progress=progress, threads=threads)
    return Film(str(film) if str(film) not in ("", ".") else None, painted, failed)


@_checked
def export(folder: Path, formats: Sequence[str] = ("gltf",), *, out: Path = "",
           progress: Optional[Progress] = None, threads: int = 0) -> List[str]:
    """The motion for other programs: of "gltf", "pc2", "usd", "vtu". The file of each that is to be opened."""
    files = _limber.export(folder, _list_of(formats), out=out, progress=progress, threads=threads)
    return [str(file) for file in files]


@_checked
def report(folder: Path, file: Path = "", *, progress: Optional[Progress] = None, threads: int = 0) -> str:
    """One HTML page about a work folder; verifies it, and takes as long."""
    parent = os.path.dirname(os.fspath(file)) or "."
    if os.fspath(file) and not (os.path.isdir(parent) and os.access(parent, os.W_OK)):
        raise InputError(f"{os.fspath(file)}: {parent} is no folder that can be written to")
    return str(_limber.report(folder, file=file, progress=progress, threads=threads))
