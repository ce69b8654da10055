"""Tests the Python module against closed forms, published numbers and the results that its examples state."""

import concurrent.futures
import os
import pathlib
import re
import subprocess
import sys
import tempfile
import unittest

import numpy as np
import youbot


class Friction(unittest.TestCase):
    def test_a_law_has_its_closed_form(self):
        # Table 4 of the thesis: Fc 0.03718, Fs 0.08976 N·m, vs 0.1516 rad/s, δ 1.047, σ2 0.01898 N·m·s/rad.
        law = youbot.Law("kfm", coulomb_Nm=0.03718, static_Nm=0.08976, stribeck_velocity_rad_per_s=0.1516,
                         stribeck_exponent=1.047, viscous_Nm_s_per_rad=0.01898)
        v = np.array([-3.0, -0.1516, 0.1516, 8.0])
        magnitude = 0.03718 + 0.05258 * np.exp(-((np.abs(v) / 0.1516) ** 1.047)) + 0.01898 * np.abs(v)
        np.testing.assert_allclose(law.steady_Nm(v), np.sign(v) * magnitude, rtol=1e-12)
        self.assertIsInstance(law.steady_Nm(1.0), float)
        self.assertIn("lugre", youbot.law_names())

    def test_a_law_with_memory_begins_as_its_spring(self):
        law = youbot.Law("dahl", coulomb_Nm=0.05, stiffness_Nm_per_rad=100)
        torque = law.torques_Nm(np.full(5, 1e-3), period_s=1e-3)  # 1 µrad each
        np.testing.assert_allclose(torque, 100e-6 * np.arange(1, 6), rtol=1e-2)

    def test_what_is_unknown_is_named(self):
        with self.assertRaisesRegex(ValueError, "there are coulomb"):
            youbot.Law("stiction_of_mine")
        with self.assertRaisesRegex(ValueError, "it has torque_Nm"):
            youbot.Effect("coulomb", torque=1)
        with self.assertRaisesRegex(ValueError, "one-dimensional"):
            youbot.Law("dahl").torques_Nm(np.zeros((2, 2)), period_s=1e-3)

    def test_a_drive_without_friction_obeys_newton(self):
        motion = youbot.DriveModel(0.01).simulate(np.full(1001, 0.02), period_s=1e-3)
        # 2 rad/s² for one second.
        self.assertAlmostEqual(motion["velocity_rad_per_s"][1000], 2, places=9)
        self.assertAlmostEqual(motion["position_rad"][1000], 1, places=2)
        self.assertAlmostEqual(motion["time_s"][1000], 1, places=12)

    def test_a_simulation_keeps_its_own_command(self):
        torque = np.full(10, 0.02)
        motion = youbot.DriveModel(0.01).simulate(torque, period_s=1e-3)
        torque[:] = 0
        self.assertEqual(motion["torque_command_Nm"][5], 0.02)

    def test_a_model_file_comes_back(self):
        model = youbot.DriveModel(0.011, [youbot.Effect("coulomb", torque_Nm=0.05),
                                          youbot.Effect("viscous", coefficient_Nm_s_per_rad=0.01)], name="wheel-1")
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "model.toml"
            model.write(path)
            again = youbot.DriveModel.read(path)
            path.write_text(path.read_text() + "colour = 3\n")
            with self.assertRaisesRegex(youbot.FileError, r"model\.toml:\d+: .*colour"):
                youbot.DriveModel.read(path)
        self.assertEqual([e.name for e in again.effects], ["coulomb", "viscous"])
        self.assertEqual(again.effects[0].parameters, {"torque_Nm": 0.05})
        np.testing.assert_allclose(again.sliding_torque_Nm([-2.0, 2.0]), [-0.07, 0.07], rtol=1e-12)

    def test_compensation_never_turns_a_command_round(self):
        compensation = youbot.FrictionCompensation(youbot.DriveModel(0.01, [youbot.Effect("coulomb", torque_Nm=0.05)]),
                                                   margin=0.9)
        compensation.reset(0)
        self.assertAlmostEqual(compensation.step(0.1, 0), 0.9 * 0.05, places=9)
        self.assertAlmostEqual(compensation.step(-0.1, 0), -0.9 * 0.05, places=9)
        self.assertEqual(compensation.step(0, 0), 0)


class Recordings(unittest.TestCase):
    def test_columns_are_views_that_outlive_the_recording(self):
        recording = youbot.Recording({"time_s": np.arange(3.0), "position_rad": [1, 2, 3]}, rig="wheel-1")
        position = recording["position_rad"]
        self.assertFalse(position.flags.writeable)
        self.assertFalse(position.flags.owndata)
        del recording
        np.testing.assert_array_equal(position, [1, 2, 3])

    def test_a_file_comes_back(self):
        recording = youbot.Recording({"time_s": [0, 0.001], "position_rad": [0.1, 0.2], "torque_command_Nm": [0, 1 / 3]},
                                     rig="wheel-1", experiment="ramp")
        with tempfile.TemporaryDirectory() as folder:
            path = os.path.join(folder, "ramp.csv")
            recording.write(path)
            again = youbot.read_recording(path)
            with self.assertRaisesRegex(youbot.SetupError, "ramp.csv"):
                recording.write(path)  # already exists
            with open(path, "a") as file:
                file.write("0.002,0.3")
            with self.assertWarnsRegex(UserWarning, "ramp.csv:"):
                self.assertEqual(len(youbot.read_recording(path)), 2)
        self.assertEqual((again.rig, again.experiment, len(again)), ("wheel-1", "ramp", 2))
        self.assertEqual(again["torque_command_Nm"][1], 1 / 3)
        self.assertIn("position_rad", again)
        with self.assertRaisesRegex(KeyError, "it has time_s"):
            again["angle"]

    def test_columns_have_one_length(self):
        with self.assertRaisesRegex(ValueError, "column b has 2 values"):
            youbot.Recording({"a": [1, 2, 3], "b": [1, 2]})


class Fits(unittest.TestCase):
    def test_a_map_gives_its_parameters_back(self):
        random = np.random.default_rng(1)
        speed = np.repeat([0.02, 0.05, 0.1, 0.2, 0.4, 0.8, 1.5, 3, 5, 8], 4)
        v = np.concatenate([speed, -speed])
        truth = {"coulomb": 0.05, "viscous": 0.012, "stribeck": 0.09}
        level = 0.05 + 0.04 * np.exp(-((np.abs(v) / 0.2) ** 2)) + 0.012 * np.abs(v)
        fit = youbot.fit_friction(v, np.sign(v) * level + random.normal(0, 5e-4, len(v)), "kfm")
        first = {}
        for parameter in fit.parameters:
            first.setdefault(parameter.effect, parameter)
        self.assertEqual(first.keys(), truth.keys())
        for effect, value in truth.items():
            self.assertLess(first[effect].lower - 2e-4, value, effect)
            self.assertGreater(first[effect].upper + 2e-4, value, effect)
            self.assertAlmostEqual(first[effect].value, value, delta=2e-3)
        self.assertAlmostEqual(fit.torque_Nm(1.5), 0.05 + 0.012 * 1.5, delta=1e-3)
        with self.assertRaisesRegex(ValueError, "one length"):
            youbot.fit_friction(v, [1.0])


class Robots(unittest.TestCase):
    def test_a_base_is_driven_and_switched_off(self):
        with youbot.Robot() as robot:
            self.assertEqual(robot.names, ["wheel-1", "wheel-2", "wheel-3", "wheel-4"])
            self.assertFalse(robot.step().enabled)
            self.assertTrue(robot.enable().enabled)
            for _ in range(1000):
                state = robot.step(velocity_rad_per_s=[2, -2, 2, -2])
            np.testing.assert_allclose(state.velocity_rad_per_s, [2, -2, 2, -2], atol=0.2)
            self.assertAlmostEqual(state.time_s, 1.0, delta=0.1)
            with self.assertRaisesRegex(ValueError, "each of the 4 joints"):
                robot.step(torque_Nm=[1])
            with self.assertRaisesRegex(ValueError, "one of them"):
                robot.step(torque_Nm=[0] * 4, position_rad=[0] * 4)

    def test_a_fault_is_an_exception_and_ends_with_disable(self):
        with youbot.Robot() as robot:
            robot.enable()
            with self.assertRaisesRegex(youbot.RobotFault, "not a finite number"):
                robot.step(torque_Nm=[np.nan] * 4)
            with self.assertRaises(youbot.RobotFault):
                robot.step()
            robot.disable()
            self.assertTrue(robot.enable().enabled)

    def test_an_enable_that_fails_leaves_nothing_enabled(self):
        with youbot.Robot("wire", on_ground=False) as robot:  # its boards take some cycles
            with self.assertRaisesRegex(youbot.RobotFault, "do not obey"):
                robot.enable(timeout_s=0)
            for _ in range(500):
                state = robot.step(velocity_rad_per_s=[2] * 4)
            self.assertFalse(state.enabled)
            # 1 rad if the drives obeyed; the boards' search for their commutation may turn a wheel a little.
            self.assertLess(np.abs(state.position_rad).max(), 0.1)
            for wrong in (np.inf, np.nan, -1):
                with self.assertRaisesRegex(ValueError, "timeout_s must be"):
                    robot.enable(timeout_s=wrong)
        with self.assertRaisesRegex(ValueError, "period_s must be 0.0005 to 0.01"):
            youbot.Robot(period_s=0.1)

    def test_threads_take_turns(self):
        with youbot.Robot() as robot:
            robot.enable()
            with concurrent.futures.ThreadPoolExecutor(4) as threads:
                times = list(threads.map(lambda _: robot.step().time_s, range(2000)))
            self.assertEqual(len(set(times)), 2000)
            self.assertFalse(robot.disable().enabled)

    def test_an_unknown_robot_is_refused_with_those_there_are(self):
        with self.assertRaisesRegex(ValueError, "loopback"):
            youbot.Robot("toaster")
        with self.assertRaisesRegex(youbot.SetupError, "nosuch0"):
            with youbot.Robot("ethercat:nosuch0"):
                pass


def example(name):
    return subprocess.run([sys.executable, os.path.join(os.environ["EXAMPLES"], name)], check=True, text=True,
                          stdout=subprocess.PIPE).stdout


class Examples(unittest.TestCase):
    def test_a_wheel_that_friction_holds_turns_with_compensation(self):
        turned = [float(x) for x in re.findall(r"turned ([\d.]+) rad", example("compensate_wheel.py"))]
        self.assertLess(turned[0], 0.02)
        self.assertGreater(turned[1], 1)

    def test_the_hidden_cogging_is_named(self):
        output = example("missing_effect.py")
        found = re.search(r"\ncogging amplitude_Nm \S+ \(([\d.]+) to ([\d.]+)\)", output)
        self.assertTrue(float(found[1]) - 2e-4 < 0.012 < float(found[2]) + 2e-4, output)
        self.assertEqual(len(re.findall(r"^\w+ \w+ [\d.]+ \(", output, re.M)), 1, output)


if __name__ == "__main__":
    unittest.main()
