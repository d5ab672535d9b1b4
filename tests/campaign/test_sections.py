"""What a study does beyond its three criteria: cases, amplitudes, coupling, no delay, scaled Levels, the translational rate."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from levelone.campaign import BuiltinModel, analysis, build_model, sweep
from levelone.campaign.amplitudes import amplitudes_section
from levelone.campaign.cases import cases_section
from levelone.campaign.coupling import NO_PATH, coupling_section, relative
from levelone.campaign.delay import delay_section
from levelone.campaign.froude import froude_section, judged
from levelone.campaign.models.builtin import CRITERIA, RESPONSES
from levelone.config.study_file import Study
from levelone.config.study_sections import Cases, Coupling, Froude
from levelone.handling.froude import froude_scaled
from levelone.handling.levels import Level, load_boundaries
from levelone.handling.translation import RISE
from levelone.status import Status
from levelone.uncertainty import Factor, FactorSpace, Responses, Uniform, latin_hypercube
from levelone.vehicle import Vehicle, batch_of

COLUMNS = ("C_L0", "C_mq")


def cases(criterion: str, rows: list[list[float]], columns: tuple[str, ...] = COLUMNS) -> Cases:
    return Cases("a table", criterion, columns, np.array(rows), "made up")


def flown(study: Study, *given: Cases) -> dict:
    return cases_section(replace(study, cases=given), build_model(study))


class TestCases:
    @pytest.mark.parametrize("criterion", ["attitude_quickness", "dynamic_stability", "bandwidth"])
    def test_a_case_of_nominal_coefficients_is_the_nominal_vehicle(self, study: Study, criterion: str) -> None:
        nominal = [float(study.nominal[study.space.index(name)]) for name in COLUMNS]
        block = flown(study, cases(criterion, [nominal]))[criterion]
        expected = build_model(study).nominal()
        for name, values in block["values"].items():
            if not name.endswith("_swept"):
                assert values == pytest.approx([expected.responses.column(name)[0]], rel=1e-12)
        assert block["level"] == expected.levels[criterion].tolist()

    def test_each_row_is_a_vehicle_of_its_own(self, study: Study) -> None:
        rows = [[0.4524, -6.9263], [0.6268, -6.9263], [0.6268, -16.169]]
        forth = flown(study, cases("dynamic_stability", rows))["dynamic_stability"]["values"]
        back = flown(study, cases("dynamic_stability", rows[::-1]))["dynamic_stability"]["values"]
        assert forth["zeta"] == back["zeta"][::-1]
        assert len(set(forth["omega_n"])) == 3

    @pytest.mark.paper
    def test_sweep_of_half_a_metre_a_second_reads_the_bandwidth_of_the_linear_response(self, study: Study) -> None:
        """The study verified that this amplitude does not affect the computation."""
        block = flown(study, cases("bandwidth", [[0.4524, -6.9263]]))["bandwidth"]
        assert block["amplitude"] == 0.5
        assert block["values"]["omega_bw_swept"] == pytest.approx(block["values"]["omega_bw"], rel=0.02)
        assert block["values"]["tau_p_swept"] == pytest.approx(block["values"]["tau_p"], rel=0.02)

    def test_sweep_reaches_two_and_a_half_times_omega_180(self, study: Study) -> None:
        block = flown(study, cases("bandwidth", [[0.4524, -6.9263]]))["bandwidth"]
        model = replace(build_model(study), targets=COLUMNS)
        (reading,), _ = model.linear_readings(model.batch([[0.4524, -6.9263]]), ("q",))
        assert block["omega_max"] == pytest.approx([2.5 * reading.omega_180[0]], rel=1e-12)

    def test_sweep_that_ends_too_early_has_no_phase_delay(self, study: Study, monkeypatch: pytest.MonkeyPatch) -> None:
        monkeypatch.setattr(sweep, "BELOW_NYQUIST", 0.0)
        short = replace(study, sweep=replace(study.sweep, omega_max=8.0))
        block = flown(short, cases("bandwidth", [[0.4524, -6.9263]]))["bandwidth"]
        assert np.isnan(block["values"]["tau_p_swept"]).all()
        assert block["status"]["tau_p_swept"] == [Status.RANGE_TOO_SHORT.text]
        assert block["status"]["omega_bw_swept"] == ["ok"]

    def test_case_that_cannot_fly_says_so_in_every_value(self, study: Study) -> None:
        block = flown(study, cases("bandwidth", [[7.0], [40.0]], ("M",)))["bandwidth"]
        for name, values in block["values"].items():
            assert np.isfinite(values).tolist() == [True, False]
            assert block["status"][name][1] == Status.TRIM_FAILED.text
        assert block["level"][1] == Level.UNDEFINED


class TestAmplitudes:
    def test_attitude_grows_with_the_amplitude_and_so_do_the_differences(self, study: Study) -> None:
        entries, data = amplitudes_section(replace(study, amplitudes=(0.1, 1.0)), build_model(study))
        small, large = entries
        assert large["theta_pk_deg"] == pytest.approx(10.0 * small["theta_pk_deg"], rel=0.05)
        assert large["max_gain_difference_db"] > small["max_gain_difference_db"]
        assert large["max_phase_difference_deg"] > small["max_phase_difference_deg"]
        assert small["status"] == small["tau_p_status"] == "ok"
        assert data["amplitude"].values.tolist() == [0.1, 1.0]

    def test_responses_kept_are_those_compared(self, study: Study) -> None:
        model = build_model(study)
        (entry,), data = amplitudes_section(replace(study, amplitudes=(0.25,)), model)
        inside = data.sel(omega=slice(0.5, 12.0)).isel(amplitude=0)
        linear = sweep.sweep_check(model, study.sweep, study.windows).model
        exact = linear.frequency_response("V_lon", "q", inside["omega"].values).value[0]
        found = inside["q_re"].values + 1j * inside["q_im"].values
        assert 20.0 * np.abs(np.log10(np.abs(found / exact))).max() == pytest.approx(entry["max_gain_difference_db"], rel=1e-9)
        assert inside["coherence"].values.min() == pytest.approx(entry["coherence_min"], rel=1e-12)

    def test_vehicle_that_cannot_fly_says_so(self, study: Study) -> None:
        mass = replace(study.vehicle.airframe.mass, mass=40.0)
        heavy = replace(study.vehicle, airframe=replace(study.vehicle.airframe, mass=mass))
        (entry,), _ = amplitudes_section(replace(study, amplitudes=(0.1,)), replace(build_model(study), vehicle=heavy))
        assert entry["status"] == entry["tau_p_status"] == Status.TRIM_FAILED.text
        keys = ("omega_bw", "theta_pk_deg", "max_gain_difference_db", "within", "coherence_min")
        assert np.isnan([entry[key] for key in keys]).all()


class TestDelay:
    def test_same_reading_as_the_study_where_the_delay_is_nominal(self, study: Study) -> None:
        model, sample = build_model(study), latin_hypercube(study.space, 12, 5)
        section = delay_section(study, model, sample)
        points = sample.points.copy()
        points[:, study.space.index("tau_d")] = 0.0
        expected = model.assess(points).responses
        for name in ("omega_bw", "tau_p"):
            kept = {key: section["responses"][name][key] for key in analysis.statistics(expected.column(name))}
            assert kept == analysis.statistics(expected.column(name))
        assert section["n"] == 12
        assert section["tau_d"] == 0.0

    def test_without_the_delay_the_phase_delay_spreads_less(self, study: Study) -> None:
        model, sample = build_model(study), latin_hypercube(study.space, 40, 5)
        varied = model.assess(sample.points).responses.column("tau_p")
        assert delay_section(study, model, sample)["responses"]["tau_p"]["std"] < 0.9 * np.std(varied, ddof=1)

    def test_study_without_the_factor_says_that_nothing_was_held(self, study: Study) -> None:
        keep = [j for j, target in enumerate(study.targets) if target != "tau_d"]
        space = FactorSpace(study.space.factors[j] for j in keep)
        other = replace(study, space=space, targets=tuple(study.targets[j] for j in keep), nominal=study.nominal[keep])
        section = delay_section(other, build_model(other), latin_hypercube(space, 4, 1))
        assert section["responses"] == {}
        assert "varies no rotor delay" in section["note"]


def responses(**columns: list[float]) -> Responses:
    """Made-up values of all responses on as many runs as given; the others are 1."""
    n = len(next(iter(columns.values())))
    table = np.column_stack([columns.get(name, [1.0] * n) for name in RESPONSES])
    return Responses.from_values(table, tuple(RESPONSES))


class TestFroude:
    def test_unscaled_boundaries_give_the_levels_of_the_flight(self, study: Study) -> None:
        model, sample = build_model(study), latin_hypercube(study.space, 30, 2)
        points = sample.points.copy()
        points[0, study.space.index("M")] = 40.0
        assessed = model.assess(points)
        levels, extrapolated = judged(assessed.responses, study.boundaries, study.task)
        assert list(levels) == list(CRITERIA)
        for criterion in CRITERIA:
            np.testing.assert_array_equal(levels[criterion], assessed.levels[criterion])
        np.testing.assert_array_equal(extrapolated, assessed.extrapolated)

    @pytest.mark.theory
    def test_limits_of_a_vehicle_of_a_quarter_of_the_length(self) -> None:
        """Rates double: the all-other-tasks lines at 1 and 0.5 rad/s move to 2 and 1, the rise times of 2.5 and 5 s to half."""
        scaled = froude_scaled(load_boundaries(), 4.0, 16.0)
        made = responses(
            omega_bw_attitude=[2.01, 1.99, 1.01, 0.99],
            tau_p_attitude=[0.05, 0.059, 0.05, 0.05],
            rise_time=[1.26, 2.49, 1.24, 2.51],
            zeta=[0.36, 0.34, 0.36, 0.34],
            omega_n=[5.0, 5.0, 0.9, 0.9],
        )
        levels, _ = judged(made, scaled, "all_other")
        assert levels["bandwidth"].tolist() == [1, 2, 2, 3]
        assert levels["translational_rate"].tolist() == [1, 1, 2, 2]
        assert levels["dynamic_stability"].tolist() == [
            1,
            2,
            1,
            1,
        ]  # below the doubled corner of 1 rad/s hardly any damping is asked
        late = responses(omega_bw_attitude=[5.0], tau_p_attitude=[0.061])
        assert judged(late, scaled, "all_other")[0]["bandwidth"].tolist() == [Level.OUTSIDE]

    def test_quickness_limit_rises_with_the_rate_at_the_same_angle(self) -> None:
        chart = load_boundaries().chart("attitude_quickness", "pitch")
        limit = float(chart.limits(np.radians(10.0))[0])
        made = responses(delta_theta_min=[np.radians(10.0)] * 2, quickness=[1.99 * limit, 2.01 * limit])
        assert judged(made, froude_scaled(load_boundaries(), 4.0, 16.0), "all_other")[0]["attitude_quickness"].tolist() == [2, 1]

    def test_equal_lengths_give_the_shares_of_the_study(self, study: Study) -> None:
        assessed = build_model(study).assess(latin_hypercube(study.space, 30, 2).points)
        section = froude_section(replace(study, froude=Froude(3.0, 3.0, "the same")), assessed)
        plain = analysis.level_shares(assessed)
        assert {key: section[key] for key in plain} == plain
        assert section["scale"] == 1.0

    def test_lengths_and_confidence_are_stated(self, study: Study) -> None:
        assessed = build_model(study).assess(latin_hypercube(study.space, 8, 2).points)
        section = froude_section(replace(study, froude=Froude(4.0, 16.0, "why")), assessed)
        assert (section["length"], section["reference_length"], section["basis"], section["scale"]) == (4.0, 16.0, "why", 2.0)
        assert "high" not in " ".join(section["confidence"].values())


def with_roll_factors(study: Study, vehicle: Vehicle | None = None) -> tuple[Study, BuiltinModel]:
    """A small coupling screening of the study's factors with two of the roll axis."""
    added = (Factor("I_x", Uniform(0.4, 0.6)), Factor("C_lp", Uniform(-0.6, -0.4)))
    given = Coupling(
        space=FactorSpace((*study.space.factors, *added)),
        targets=(*study.targets, "I_x", "C_lp"),
        nominal=np.append(study.nominal, [0.5, -0.5]),
        trajectories=2,
        added=("I_x", "C_lp"),
    )
    flown_by = replace(study, coupling=given, vehicle=vehicle or study.vehicle)
    return flown_by, build_model(flown_by)


def lopsided(vehicle: Vehicle) -> Vehicle:
    """One rotor weaker than the others: the controller holds the trim, but a pitch command now rolls the aircraft."""
    weaker = vehicle.airframe.rotors.effectiveness.copy()
    weaker[0] = 0.85
    rotors = replace(vehicle.airframe.rotors, effectiveness=weaker)
    return replace(vehicle, airframe=replace(vehicle.airframe, rotors=rotors))


class TestCoupling:
    def test_symmetric_vehicle_has_no_path_and_drops_every_roll_factor(self, study: Study) -> None:
        seen: list[tuple[int, int]] = []
        section = coupling_section(*with_roll_factors(study), study.seed, lambda stage, done, total: seen.append((done, total)))
        runs = 2 * (len(study.space) + 3)
        assert section["n"] == runs
        assert seen[0] == (0, runs)
        assert seen[-1] == (runs, runs)
        assert section["note"] == NO_PATH
        assert set(section["mu_star"]["ratio"].values()) == {0.0}
        assert (section["ratio"]["max"], section["level_shares"]["level_1"]) == (0.0, 1.0)
        assert {"I_x", "C_lp"} <= set(section["dropped"])
        assert not {"I_y", "K_T", "tau_d"} & set(section["dropped"])
        assert section["undecided"] == []

    def test_weaker_rotor_rolls_the_aircraft_and_its_roll_inertia_counts(self, study: Study) -> None:
        section = coupling_section(*with_roll_factors(study, lopsided(study.vehicle)), study.seed)
        assert "note" not in section
        assert section["ratio"]["min"] > 1e-4
        assert section["mu_star"]["ratio"]["I_x"] > 0.0
        assert sum(section["ratio_literal_status"].values()) == section["n"]
        assert sum(section["level_shares"][key] for key in ("level_1", "level_2", "level_3", "outside", "failed")) == pytest.approx(
            1.0
        )

    def test_failed_runs_leave_factors_undecided_where_the_policy_refuses(self, study: Study) -> None:
        wide = [replace(f, distribution=Uniform(7.0, 40.0)) if f.name == "M" else f for f in study.space.factors]
        given, model = with_roll_factors(replace(study, space=FactorSpace(wide), policy="refuse"))
        section = coupling_section(given, model, study.seed)
        assert section["failed"]["quickness"] > 0
        assert set(section["undecided"]) == set(given.coupling.space.names)
        assert section["dropped"] == []
        failed = section["ratio_status"][Status.TRIM_FAILED.text]
        assert failed == section["failed"]["ratio"] == section["ratio"]["failed"]

    @pytest.mark.theory
    def test_parts_of_the_largest(self) -> None:
        assert relative([2.0, 0.5, 0.0]).tolist() == [1.0, 0.25, 0.0]
        assert relative([0.0, 0.0]).tolist() == [0.0, 0.0]
        assert np.isnan(relative([1.0, np.nan])).all()


class TestTranslationalRate:
    def test_rise_time_and_overshoot_are_those_of_the_step(self, study: Study) -> None:
        model = build_model(study)
        history = model.fly(batch_of(study.vehicle), model.step, ("V_lon",))
        change = history.change("V_lon")[0] / model.step.amplitude
        at = int(np.argmax(change >= RISE))
        part = (RISE - change[at - 1]) / (change[at] - change[at - 1])
        nominal = model.nominal().responses
        assert nominal.column("rise_time")[0] == pytest.approx(history.time[at - 1] + part * history.dt - model.step.on, abs=1e-4)
        assert nominal.column("overshoot")[0] == pytest.approx(change.max() - 1.0, abs=1e-6)

    def test_new_responses_come_last_and_leave_the_worst_alone(self, study: Study) -> None:
        assert list(RESPONSES)[-2:] == ["rise_time", "overshoot"]
        nominal = build_model(study).nominal()
        three = [nominal.levels[name][0] for name in ("attitude_quickness", "dynamic_stability", "bandwidth")]
        assert nominal.levels["worst"][0] == max(three)
