"""The Python module beside the command: the same hashes; arrays that are shared and cannot be spoilt."""
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
import unittest
import warnings

import numpy as np

import limber

PROGRAM = os.environ["LIMBER_PROGRAM"]
WORK = tempfile.TemporaryDirectory()

CUBE = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0], [0, 0, 1], [1, 0, 1], [1, 1, 1], [0, 1, 1]], float)
FACES = np.array([[0, 2, 1], [0, 3, 2], [4, 5, 6], [4, 6, 7], [0, 1, 5], [0, 5, 4],
                  [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]])


def command(*words):
    return json.loads(subprocess.run([PROGRAM, *words, "--json", "--quiet"], check=True, capture_output=True).stdout)


def world_of(scene, **scene_options):
    """In a folder that all tests share, so that bodies are prepared once."""
    return limber.World(limber.Scene(scene, **scene_options), os.path.join(WORK.name, scene))


def in_child(queue):
    world = world_of("barriers1")
    ends = world.rollout(world.start(4), limber.pushes(4, force_n=(1, 0, 0), steps=5))
    queue.put(float(ends.positions.sum()))


class Meshes(unittest.TestCase):
    def test_hulls_are_pairs_as_coacd_gives_them(self):
        hulls = limber.decompose(CUBE, FACES, max_convex_hull=4)
        self.assertEqual(len(hulls), 1)
        for vertices, faces in hulls:
            self.assertEqual((vertices.dtype, faces.dtype), (np.float64, np.int32))
            self.assertEqual(vertices.shape, (8, 3))
            np.testing.assert_allclose(np.abs(vertices - 0.5).max(axis=1), 0.5, atol=1e-5)  # covers it, and hardly more
        self.assertEqual(hulls.triangles_uncovered, 0)

    def test_what_has_vertices_and_faces_is_a_mesh(self):
        whole = limber.decompose(CUBE, FACES)
        for mesh in ((CUBE, FACES), limber.Mesh(CUBE, FACES), limber.clean(CUBE, FACES)):
            np.testing.assert_array_equal(limber.decompose(mesh)[0][0], whole[0][0])
        self.assertEqual(len(limber.decompose(CUBE, FACES, max_convex_hull=-1, threshold=0.05)), 1)
        cage = limber.build_cage(limber.Mesh(CUBE, FACES), hulls=whole, tets=100)
        self.assertTrue(limber.certify((CUBE, FACES), cage=cage).holds)
        self.assertEqual(limber.bind((CUBE, FACES), cage=cage).outside, 0)
        with self.assertRaisesRegex(limber.InputError, "what has both"):
            limber.decompose(CUBE)
        with self.assertRaisesRegex(limber.InputError, "no limit"):
            limber.decompose(CUBE, FACES, max_convex_hull=-1)

    def test_a_body_moves_with_its_cage(self):
        body = limber.prepare(CUBE, FACES, tets=100)
        self.assertTrue(body.certificate.holds)
        affine = np.array([[2, 1, 0], [0, 1, 0.5], [-1, 0, 1]])
        np.testing.assert_allclose(body.deform(body.cage.vertices @ affine + 3), body.vertices @ affine + 3, atol=1e-12)
        np.testing.assert_allclose(
            np.einsum("vc,vcx->vx", body.binding.weights, body.cage.vertices[body.cage.tets[body.binding.tet_from_vertex]]),
            body.vertices, atol=1e-12)
        with tempfile.TemporaryDirectory() as folder:
            body.save(folder)
            np.testing.assert_array_equal(limber.load_body(folder).cage.vertices, body.cage.vertices)
            self.assertTrue(all(promise.kept for promise in limber.verify(folder)))

    def test_arrays_are_views_that_cannot_be_written_to_and_outlive_their_body(self):
        body = limber.prepare(CUBE, FACES, tets=100)
        vertices = body.cage.vertices
        self.assertFalse(vertices.flags.writeable)
        self.assertFalse(vertices.flags.owndata)
        self.assertTrue(np.shares_memory(vertices, body.cage.vertices))
        with self.assertRaises(ValueError):
            vertices[0] = 0
        kept = vertices.copy()
        del body
        np.testing.assert_array_equal(vertices, kept)

    def test_a_body_shows_itself_in_a_notebook(self):
        html = limber.prepare(CUBE, FACES, tets=100)._repr_html_()
        self.assertRegex(html, "[0-9]+ triangles")
        self.assertIn("holds", html)
        self.assertIn("src='data:image/png;base64,iVBORw0KGgo", html)

    def test_many_models_are_the_commands_and_one_that_is_none_stops_no_other(self):
        with tempfile.TemporaryDirectory() as folder:
            def path(name):
                return os.path.join(folder, name)
            os.mkdir(path("models"))
            for name, size in (("a.obj", 1), ("b.obj", 2)):
                with open(path("models/" + name), "w") as file:
                    file.write("".join(f"v {x} {y} {z}\n" for x, y, z in size * CUBE))
                    file.write("".join(f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in FACES))
            with open(path("models/c.obj"), "w") as file:
                file.write("nothing\n")
            told = command("prepare", path("models/a.obj"), "-o", path("one"), "--tets", "100")
            heard = []
            with self.assertWarnsRegex(UserWarning, "c.obj"):
                many = limber.prepare_many(path("models"), path("out"), tets=100, program=PROGRAM,
                                           progress=lambda *event: heard.append(event))
            self.assertEqual([(m.name, m.reason) for m in many], [("a.obj", ""), ("b.obj", ""), ("c.obj", "refused")])
            self.assertEqual(sorted(event[1] for event in heard), [1, 2, 3])
            body = limber.load_body(many[0].folder)
            self.assertEqual(json.loads(body.report_json())["files"]["cage.msh"], told["files"]["cage.msh"])
            for model, kept in (("a", True), ("b", False)):
                rows = {row.name: row.kept for row in limber.verify(many[0].folder, model=path(f"models/{model}.obj"))}
                self.assertEqual(rows["body: surface is the model's"], kept)
            with self.assertRaisesRegex(limber.InputError, "one of them"):
                limber.verify(many[0].folder, scene="barriers1", model=path("models/a.obj"))
            with warnings.catch_warnings():
                warnings.simplefilter("error")
                again = limber.prepare_many([path("models/a.obj"), path("models/b.obj")], path("out"), tets=100,
                                            program=PROGRAM)
            self.assertEqual([m.folder for m in again], [m.folder for m in many[:2]])
            with self.assertRaisesRegex(limber.InputError, "no.such"):
                limber.prepare_many(path("models"), path("out"), program=path("no.such"))
            with self.assertRaisesRegex(limber.InputError, "mode"):
                limber.prepare_many(path("models"), path("out"), mode="slow", program=PROGRAM)
            with self.assertRaises(KeyError):
                limber.prepare_many(path("models"), path("again"), tets=100, program=PROGRAM,
                                    progress=lambda *event: {}["enough"])

    def test_warnings_are_pythons(self):
        with self.assertWarnsRegex(UserWarning, "boundary edges"):
            limber.prepare(CUBE, FACES[:-1], tets=100)
        with warnings.catch_warnings(record=True) as heard:
            warnings.simplefilter("always")
            limber.prepare(CUBE, FACES[:-1], tets=100)
        self.assertEqual(heard[0].filename, __file__)  # where limber was called

    def test_what_is_wrong_is_named(self):
        wrong = FACES.copy()
        wrong[3, 1] = 17
        for given, word in [((CUBE, wrong), "17"), ((CUBE[:, :2], FACES), r"\(8, 2\)"), ((CUBE, FACES * 0.5), "float64"),
                            ((CUBE * np.nan, FACES), "finite"), ((CUBE, FACES + 2**40), "too large"),
                            ((CUBE, [[0, 1], [2]]), ""), (("a", "b"), "")]:
            with self.subTest(word), self.assertRaisesRegex(limber.InputError, word):
                limber.decompose(*given)
        with self.assertRaisesRegex(ValueError, "lattice"):  # InputError is one
            limber.build_cage(CUBE, FACES, mode="lettuce")
        dented = CUBE.copy()
        dented[6] = 0.4
        with self.assertRaisesRegex(limber.InputError, "hull 0: is not convex"):
            limber.build_cage(CUBE, FACES, [(dented, FACES)], mode="paper", tets=100)
        with self.assertRaisesRegex(limber.InputError, "a pair"):
            limber.build_cage(CUBE, FACES, [(CUBE, FACES, 3)], tets=100)
        cage = limber.build_cage(CUBE, FACES, tets=100)
        with self.assertRaisesRegex(limber.InputError, "node 0 has a coordinate that is not finite"):
            limber.bind(CUBE, FACES, cage).deform(cage.tets, cage.vertices * np.nan)
        with self.assertRaisesRegex(limber.InputError, "threads is 1000000"):
            limber.decompose(CUBE, FACES, threads=1000000)
        with self.assertRaisesRegex(limber.InputError, "nothing.obj: cannot be read"):
            limber.prepare("nothing.obj")
        with self.assertRaises(limber.InputError):
            limber.prepare(CUBE)
        with self.assertRaises(TypeError):
            limber.decompose(CUBE, FACES, 4)  # options are keywords
        with self.assertRaises(OSError):
            limber.prepare(CUBE, FACES, tets=100).save("/proc/limber")
        # Before any work: a model that is read in vain is not there.
        for options, words in (({"tets": 10**9}, "tets is 1000000000; it must be in .24, 200000."),
                               ({"tets": 10**12}, "tets is 1000000000000, which is out"), ({"shells": 0}, "hulls is 0"),
                               ({"max_hull_vertices": 7}, "max_hull_vertices is 7"), ({"inflate": np.nan}, "inflate"),
                               ({"concavity": -0.1}, "concavity is -0.1"), ({"mode": "lettuce"}, "mode")):
            with self.subTest(words), self.assertRaisesRegex(limber.InputError, words):
                limber.prepare("nothing.obj", **options)
        flat = limber.Cage(CUBE * [1, 1, 0], [[0, 1, 2, 3]])
        with self.assertRaisesRegex(limber.InputError, "in a plane"):
            limber.certify(CUBE, FACES, flat)

    def test_options_of_another_kind_are_named(self):
        folder = tempfile.gettempdir()
        for call, words in ((lambda: limber.prepare(CUBE, FACES, tets="many"), "prepare: tets is 'many'"),
                            (lambda: limber.prepare(CUBE, FACES, tets=100.5), "tets is 100.5; it must be a whole"),
                            (lambda: limber.prepare(CUBE, FACES, exact=1), "exact is 1; it must be True or False"),
                            (lambda: limber.decompose(CUBE, FACES, threshold=None), "threshold is None"),
                            (lambda: limber.plan("barriers1", seed="1"), "plan: seed is '1'"),
                            (lambda: limber.Scene("barriers1", set=["planner.seed=1"]), "Scene: set is "),
                            (lambda: limber.render(folder, size=160), "size is 160; it must be .width, height."),
                            (lambda: limber.render(folder, size=(160, 90, 1)), "size is .160"),
                            (lambda: limber.verify(3), "verify: folder is 3")):
            with self.subTest(words), self.assertRaisesRegex(TypeError, words):
                call()
        with self.assertRaisesRegex(limber.InputError, "no NUL"):
            limber.load_mesh("a\0b")
        with self.assertRaisesRegex(limber.InputError, "no.such.folder is no folder"):
            limber.Scene("barriers1", data="no.such.folder")

    def test_what_is_printed_says_what_it_is(self):
        body = limber.prepare(CUBE, FACES, tets=100)
        self.assertEqual(repr(body.certificate), "<limber.Certificate: holds>")
        self.assertEqual(repr(body.cage), f"<limber.Cage: {len(body.cage.tets)} tets, {len(body.cage.vertices)} nodes>")
        self.assertIn(" 1 hulls, ", repr(body))
        self.assertIn(" 0 of them outside", repr(body.binding))

    def test_units_are_those_of_files_and_arrays_alike(self):
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "slab.obj")
            slab = CUBE * [1000, 2000, 500]
            with open(file, "w", encoding="ascii") as out:
                out.writelines("v {} {} {}\n".format(*v) for v in slab)
                out.writelines("f {} {} {}\n".format(*(f + 1)) for f in FACES)
            of_file = limber.prepare(file, tets=100, scale=0.001, y_up=True)
        of_arrays = limber.prepare(slab, FACES, tets=100, scale=0.001, y_up=True)
        np.testing.assert_array_equal(of_file.vertices, of_arrays.vertices)
        np.testing.assert_allclose(np.ptp(of_arrays.vertices, axis=0), np.ptp(CUBE, axis=0) * [1, 0.5, 2])


class Scenes(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def test_a_plan_is_the_commands(self):
        told = command("plan", "barriers1", "--preset", "fast", "--seed", "1", "-o", self.path("command"))
        for threads in (1, 2):
            plan = limber.plan("barriers1", self.path(f"{threads}"), preset="fast", seed=1, threads=threads)
            self.assertEqual((plan.tree_hash, plan.trajectory_hash), (told["tree_hash"], told["trajectory_hash"]))
        self.assertEqual(plan.summary["frames"], told["frames"])
        self.assertEqual(plan.frames.shape, (told["frames"], plan._plan.world.nodes, 3))
        self.assertTrue(all(promise.kept for promise in limber.verify(self.path("2"))))
        again = limber.load_plan(self.path("2"))
        self.assertEqual(again.trajectory_hash, told["trajectory_hash"])
        np.testing.assert_array_equal(again.surface("robot", -1), plan.surface("robot", len(plan) - 1))
        self.assertIn(told["trajectory_hash"], again._repr_html_())
        world = again.world
        self.assertEqual((world.scene.robot, sorted(world.bodies)), ("robot", ["lower_plate", "robot", "upper_plate"]))
        last = world.robot_centers(again.states.take([-1]))[0]
        self.assertLess(np.linalg.norm(last - world.scene.goal.center_of_mass_m), world.scene.goal.radius_m)
        for frame in (len(again), -len(again) - 1):
            with self.assertRaisesRegex(limber.InputError, f"there is no frame {frame}; "):
                again.surface("robot", frame)
        film = limber.render(self.path("2"), size=(64, 36), frames="0-1")
        self.assertEqual((film.frames_painted, film.frames_failed), (2, 0))
        self.assertTrue(limber.export(self.path("2"), "gltf")[0].endswith(".glb"))
        with self.assertRaisesRegex(limber.InputError, "no format is named"):
            limber.export(self.path("2"), [])
        with self.assertRaisesRegex(limber.InputError, "there is no folder"):  # before any frame
            limber.render(self.path("2"), size=(64, 36), video=self.path("none/film.mp4"),
                          progress=lambda *event: self.fail(event))
        with self.assertRaisesRegex(limber.InputError, "mp4"):
            limber.render(self.path("2"), size=(64, 36), frames="0", video=self.path("film.doc"),
                          progress=lambda *event: self.fail(event))

    def test_a_motion_is_verified_as_of_a_scene(self):
        limber.simulate("barriers1", self.path("simulated"), preset="fast", duration=0.05)
        for named in ({"scene": "barriers1"}, {"scene": limber.Scene("barriers1", preset="fast")}):  # fast is its own
            self.assertTrue(all(promise.kept for promise in limber.verify(self.path("simulated"), **named)))
        rows = limber.verify(self.path("simulated"), scene="barriers1", set={"planner": {"max_force_n": 9}})
        broken = [row.value for row in rows if not row.kept]
        self.assertEqual(len(broken), 1)
        self.assertIn("planner.preset=fast; asked for were planner.max_force_n=9", broken[0])
        with self.assertRaisesRegex(limber.InputError, "none is named"):
            limber.verify(self.path("simulated"), preset="fast")

    def test_the_path_is_what_its_pushes_do(self):
        world = world_of("barriers1", preset="fast")
        plan = world.plan(seed=1)
        state = world.start()
        for i in range(len(plan.pushes)):
            state = world.rollout(state, plan.pushes[i:i + 1])
        ends = plan.states
        self.assertEqual(int(state.steps[0]), int(round(plan.duration_s / world.dt_s)))
        self.assertLess(abs(int(ends.steps[-1]) - int(state.steps[0])), 1 / (plan.frames_per_second * world.dt_s))
        if ends.steps[-1] == state.steps[0]:
            np.testing.assert_array_equal(ends.positions[-1], state.positions[0])

    def test_a_pressure_blows_a_soft_robot_up_and_moves_it_nowhere(self):
        world = world_of("barriers1")
        robot = world.nodes_of("robot")
        ends = world.rollout(world.start(2), limber.pushes(2, "none", pressure_pa=[0, 2000], steps=400))
        places = ends.positions.reshape(2, -1, 3)[:, robot]
        sizes = np.ptp(places, axis=1)
        self.assertTrue((sizes[1] > 1.02 * sizes[0]).all())
        np.testing.assert_allclose(places[1].mean(axis=0), places[0].mean(axis=0), atol=1e-3)
        with self.assertRaisesRegex(limber.InputError, "pressure_pa must not be negative"):
            world.rollout(world.start(), limber.pushes(1, "none", pressure_pa=-1, steps=1))
        with self.assertRaisesRegex(limber.InputError, "blows up soft robots alone"):
            rigid = world_of("barriers1", set={"bodies": {"robot": {"kind": "rigid"}}})
            rigid.rollout(rigid.start(), limber.pushes(1, "none", pressure_pa=1, steps=1))

    def test_rollouts_in_a_batch_are_those_alone(self):
        world = world_of("barriers1")
        robot = world.nodes_of("robot")
        self.assertGreater(robot.stop, robot.start)
        forces = np.random.default_rng(7).normal(size=(40, 3)).astype(np.float32)
        pushes = limber.pushes(40, force_n=forces, steps=np.arange(20, 60))
        ends = world.rollout(world.start(40), pushes, threads=2)
        self.assertTrue(ends.sound.all())
        for i in (0, 17, 39):
            alone = world.rollout(world.start(), pushes[i:i + 1])
            np.testing.assert_array_equal(alone.positions[0], ends.positions[i])
        shoved = world.rollout(world.start(2), limber.pushes(2, force_n=[[1e30, 0, 0], [0, 0, 0]], steps=5))
        np.testing.assert_array_equal(shoved.sound, [False, True])
        np.testing.assert_array_equal(world.rollout(shoved, limber.pushes(2, steps=2)).sound, [False, True])
        for wrong, words in (({"steps": [0.5, 5]}, "steps must be whole"), ({"sound": [0.2, 1]}, "sound must be True")):
            with self.assertRaisesRegex(limber.InputError, words):
                world.rollout(shoved._replace(**wrong), limber.pushes(2, steps=2))
        joined = limber.States.join([shoved.take(0), shoved.take(slice(1, 2)), shoved.take([True, False])])
        np.testing.assert_array_equal(joined.sound, [False, True, False])
        np.testing.assert_array_equal(joined.positions[1], shoved.positions[1])
        with self.assertRaisesRegex(limber.InputError, "state 0: its step is -1"):
            world.rollout(shoved._replace(steps=[-1, 5]), limber.pushes(2, steps=2))
        with self.assertRaisesRegex(limber.InputError, "sound must have the shape"):
            world.rollout(shoved._replace(sound=[True]), limber.pushes(2, steps=2))
        with self.assertRaisesRegex(limber.InputError, "40 pushes for 1 states"):
            world.rollout(world.start(), pushes)
        with self.assertRaisesRegex(limber.InputError, "push_dtype"):
            world.rollout(world.start(40), forces)
        with self.assertRaisesRegex(limber.InputError, "kind"):
            limber.pushes(1, "shove", steps=1)
        for options, words in (({"steps": 1.7}, "steps must be whole"), ({"steps": 2**31}, "steps must be whole"),
                               ({"steps": 0}, "steps is 0"), ({"steps": 1, "node": 0.5}, "node must be whole"),
                               ({"steps": 1, "force_n": np.inf}, "force_n must be numbers"),
                               ({"steps": 1, "force_n": 100}, r"force_n has the shape \(\)"),
                               ({"steps": 1, "target_m": (1, 2)}, r"target_m has the shape \(2,\)"),
                               ({"steps": (1, 2, 3)}, r"steps has the shape \(3,\)"),
                               ({"steps": 1, "radius_m": "wide"}, "radius_m must be numbers")):
            with self.subTest(words), self.assertRaisesRegex(limber.InputError, words):
                limber.pushes(2, **options)
        with self.assertRaisesRegex(limber.InputError, "copies is 2147483647; it must be in .0, "):
            world.start(2**31 - 1)
        with self.assertRaisesRegex(TypeError, "must be States"):
            world.rollout((shoved.positions, shoved.velocities), limber.pushes(2, steps=2))
        with self.assertRaisesRegex(limber.InputError, "no body 'bunny'"):
            world.nodes_of("bunny")

    def test_progress_is_told_and_what_it_raises_ends_the_call(self):
        stages = set()
        limber.prepare(CUBE, FACES, tets=100, progress=lambda stage, done, total, note: stages.add(stage))
        self.assertIn("prepare", stages)
        world = world_of("barriers1")

        def enough(*_):
            raise KeyError("enough")
        with self.assertRaisesRegex(KeyError, "enough"):
            world.plan(iterations=10**8, progress=enough)

    def test_ctrl_c_is_heard_and_nothing_is_left_behind(self):
        world = world_of("barriers1")
        timer = threading.Timer(0.5, lambda: os.kill(os.getpid(), signal.SIGINT))
        timer.start()
        with self.assertRaises(KeyboardInterrupt):
            world.plan(seed=1, iterations=10**8)
        timer.join()
        self.assertEqual(world.rollout(world.start(), limber.pushes(1, steps=1)).steps[0], 1)

    def test_ctrl_c_is_heard_while_a_model_is_decomposed_exactly(self):
        # A sphere with a hundred dents: hundreds of convex parts, for longer than the test waits.
        rows, columns = 16, 24
        around, up = np.meshgrid(np.arange(columns) * 2 * np.pi / columns, np.arange(1, rows) * np.pi / rows)
        radius = 1 + 0.2 * ((np.arange(columns)[None, :] + np.arange(1, rows)[:, None]) % 2)
        points = (radius * np.sin(up) * np.cos(around), radius * np.sin(up) * np.sin(around), radius * np.cos(up))
        vertices = np.vstack([np.stack(points, 2).reshape(-1, 3), [[0, 0, 1], [0, 0, -1]]])
        faces, north = [], len(vertices) - 2
        for c in range(columns):
            d, last = (c + 1) % columns, (rows - 2) * columns
            faces += [[north, c, d], [north + 1, last + d, last + c]]
            for r in range(0, last, columns):
                faces += [[r + c, r + columns + c, r + columns + d], [r + c, r + columns + d, r + d]]
        for heard_after in (0.2, 1.5):
            timer = threading.Timer(heard_after, lambda: os.kill(os.getpid(), signal.SIGINT))
            timer.start()
            with self.assertRaises(KeyboardInterrupt):
                limber.decompose(vertices, np.array(faces), exact=True)
            timer.join()

    def test_a_search_that_is_cut_is_kept_and_goes_on(self):
        whole = limber.plan("squeeze", preset="fast", seed=1)
        told = []

        def enough(stage, done, total, note):
            told.append(stage)
            if stage == "plan" and done > 0:
                raise KeyError("enough")
        for resume in range(2000):  # each time one step further at least: the first progress that is told ends it
            try:
                found = limber.plan("squeeze", self.path("cut"), preset="fast", seed=1, resume=resume > 0,
                                    progress=enough if resume < 2 else None)
                break
            except KeyError:
                self.assertFalse(limber.load_plan(self.path("cut")).solved)
        self.assertIn("plan", told)
        self.assertEqual((found.tree_hash, found.trajectory_hash), (whole.tree_hash, whole.trajectory_hash))
        self.assertEqual(found.iterations, whole.iterations)

        world = limber.World(limber.Scene("squeeze", preset="fast"))
        some = world.plan(seed=1, iterations=3)
        self.assertEqual(some.iterations, 3)
        self.assertEqual(world.plan(seed=1, resume=some).tree_hash, whole.tree_hash)
        with self.assertRaisesRegex(limber.InputError, "another world"):
            world_of("barriers1").plan(resume=some)
        with self.assertRaisesRegex(limber.InputError, "seed"):
            world.plan(seed=2, resume=some)
        with self.assertRaisesRegex(limber.InputError, "none is named"):
            limber.plan("squeeze", resume=True)
        with self.assertRaisesRegex(limber.InputError, "no plan to go on from"):
            limber.plan("squeeze", self.path("empty"), resume=True)

    def test_the_path_is_kept_alone(self):
        whole = limber.plan("squeeze", self.path("path"), preset="fast", seed=1, keep_tree="path")
        alone = limber.load_plan(self.path("path"))
        self.assertEqual((alone.tree_hash, alone.trajectory_hash), (whole.tree_hash, whole.trajectory_hash))
        whole.save(self.path("saved"), keep_tree="path")
        whole.save(self.path("all"))
        files = [open(os.path.join(self.path(f), "plan.npz"), "rb").read() for f in ("path", "saved", "all")]
        self.assertEqual(files[0], files[1])
        self.assertLess(len(files[0]), len(files[2]))
        with self.assertRaisesRegex(limber.InputError, "path alone"):
            limber.plan("squeeze", self.path("path"), preset="fast", seed=1, resume=True)
        with self.assertRaisesRegex(limber.InputError, "keep_tree"):
            limber.plan("squeeze", self.path("path"), keep_tree="foo")

    def test_other_threads_run_meanwhile(self):
        world = world_of("barriers1")
        counted, done = [0], threading.Event()

        def count():
            while not done.is_set():
                counted[0] += 1
        counter = threading.Thread(target=count)
        counter.start()
        world.rollout(world.start(64), limber.pushes(64, steps=200), threads=1)
        done.set()
        counter.join()
        self.assertGreater(counted[0], 100)

    def test_a_forked_process_goes_on(self):
        world = world_of("barriers1")
        ends = world.rollout(world.start(4), limber.pushes(4, force_n=(1, 0, 0), steps=5), threads=2)
        context = multiprocessing.get_context("fork")
        queue = context.Queue()
        child = context.Process(target=in_child, args=(queue,))
        child.start()
        self.assertEqual(queue.get(timeout=120), float(ends.positions.sum()))
        child.join()

    def test_scenes_are_read_and_refused(self):
        self.assertIn("barriers1", limber.scene_names())
        scene = limber.Scene("barriers1", set={"planner.seed": 9, "planner.preset": "fast"})
        self.assertEqual(scene.robot, "robot")
        self.assertEqual(limber.Scene("barriers1", set={"planner": {"max_force_n": 9}}).max_force_n, 9)
        with self.assertRaisesRegex(limber.InputError, "planner.seed is None"):
            limber.Scene("barriers1", set={"planner.seed": None})
        with self.assertRaisesRegex(limber.InputError, "no scene is named"):
            limber.Scene("")
        for words in ({"file_or_name": "barriers9"}, {"file_or_name": "barriers1", "set": {"planner.speed": 1}},
                      {"file_or_name": "barriers1", "preset": "slow"}):
            with self.assertRaises(limber.InputError):
                limber.Scene(**words)


if __name__ == "__main__":
    unittest.main()
