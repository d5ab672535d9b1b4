"""Handling qualities of GUAM's velocity loop, from the files that ``guam_state_space.py`` writes.

    python tools/guam_closed_loop.py guam guam-ideal --png guam-closed-loop.png

Folders hold the same trim points; the first is drawn in full lines, the second dashed and for its first point alone. The table goes
to the screen: pitch mode, bandwidth and phase delay read on -theta / V_lon and on q / V_lon, and a step of 1 m/s.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from matplotlib.ticker import MultipleLocator

from levelone.campaign.models.state_space import StateSpaceSource
from levelone.config.model_table import Channel, StateSpaceTable
from levelone.config.state_space_file import load_state_space
from levelone.handling.bandwidth import bandwidth
from levelone.handling.history import TimeHistory
from levelone.handling.manoeuvres import step
from levelone.handling.translation import translational_rate
from levelone.report import style

FOOT = 0.3048
INPUTS = (Channel("V_lon", "u_ref", "ft/s", FOOT, 1), Channel("V_vert", "w_ref", "ft/s", FOOT, -1))
OUTPUTS = (
    Channel("V_lon", "u", "ft/s", FOOT, 1),
    Channel("V_vert", "w", "ft/s", FOOT, -1),
    Channel("q", "q", "rad/s", 1.0, 1),
    Channel("theta", "theta", "rad", 1.0, 1),
)
OMEGA = np.geomspace(0.03, 40.0, 4000)
POINT = np.zeros(0)
HEAD = (
    "file",
    "omega_n",
    "zeta",
    "bw_phase",
    "bw_gain",
    "omega_180",
    "tau_p",
    "bw_phase",
    "omega_180",
    "tau_p",
    "rise",
    "overshoot",
)


def source_of(path: Path) -> StateSpaceSource:
    """A file as something that can be flown: forward speed and climb in feet per second, the vertical one downwards."""
    return StateSpaceSource(StateSpaceTable("state-space", (), INPUTS, OUTPUTS, path), ())


def flown(source: StateSpaceSource) -> TimeHistory:
    """A step of 1 m/s in commanded ground speed."""
    return source.fly(POINT, step("V_lon", 1.0, trim_speed=0.0, duration=60.0))


def row(path: Path) -> list[float]:
    """The numbers of one file, in the order of HEAD."""
    source = source_of(path)
    poles = load_state_space(path).system({}).poles()
    pitch = poles[(poles.imag > 2.0) & (np.abs(poles.real) < 5.0)][0]
    attitude = bandwidth(-source.frequency_response(POINT, "V_lon", "theta", OMEGA))
    rate = bandwidth(source.frequency_response(POINT, "V_lon", "q", OMEGA))
    speed = translational_rate(flown(source))
    return [
        abs(pitch), -pitch.real / abs(pitch),
        *(float(value) for value in (attitude.omega_bw_phase, attitude.omega_bw_gain, attitude.omega_180, attitude.tau_p)),
        *(float(value) for value in (rate.omega_bw_phase, rate.omega_180, rate.tau_p)),
        float(speed.rise_time[0]), float(speed.overshoot[0]),
    ]  # fmt: skip


def draw(first: list[Path], second: list[Path], out: Path) -> None:
    """Frequency responses of attitude and rate to the speed command, and the step."""
    margins = style.Margins(top=0.5, beside=0.62, left=0.55)
    with style.paper():
        figure, axes = style.sheet(style.PAGE, 3.7, 2, 3, sharex="col", margins=margins)
        colours = (style.BLUE, style.GREEN, style.ORANGE, style.VERMILLION)
        lines = [(path, colour, "-") for path, colour in zip(first, colours, strict=True)]
        for path, colour, dash in [*lines, *[(path, style.BLACK, "--") for path in second[:1]]]:
            source = source_of(path)
            for column, (output, sign) in zip(axes.T, (("theta", -1.0), ("q", 1.0)), strict=False):
                response = source.frequency_response(POINT, "V_lon", output, OMEGA).scaled(sign)
                column[0].semilogx(OMEGA, response.gain_db, color=colour, linestyle=dash)
                column[1].semilogx(OMEGA, np.degrees(response.phase), color=colour, linestyle=dash)
            record = flown(source)
            shown = record.time < 21.0
            name = f"{float(path.stem[1:]) * FOOT:.1f} m/s" + ("" if dash == "-" else ", ideal actuators")
            axes[0, 2].plot(record.time[shown], record.channels["V_lon"][0, shown], color=colour, linestyle=dash, label=name)
            axes[1, 2].plot(record.time[shown], np.degrees(record.channels["theta"][0, shown]), color=colour, linestyle=dash)
        titles = (r"$-\theta/V_{\mathrm{lon,ref}}$", r"$q/V_{\mathrm{lon,ref}}$", "step of 1 m/s")
        labels = (("Gain, dB", "Gain, dB", r"$V_{\mathrm{lon}}$, m/s"), ("Phase, deg", "Phase, deg", r"$\theta$, deg"))
        for panels, texts in zip(axes, labels, strict=True):
            for panel, text in zip(panels, texts, strict=True):
                panel.set_ylabel(text)
                style.grid(panel)
        for panel, title, below in zip(axes[0], titles, (r"$\omega$, rad/s", r"$\omega$, rad/s", "t, s"), strict=True):
            panel.set_title(title)
            axes[1, list(axes[0]).index(panel)].set_xlabel(below)
        for panel in axes[1, :2]:
            panel.yaxis.set_major_locator(MultipleLocator(90))
            panel.set_ylim(-450, 90)
            panel.set_xlim(OMEGA[0], OMEGA[-1])
        style.key(figure, axes[0, 2].get_legend_handles_labels()[0], columns=5)
        out.write_bytes(style.png_of(figure))


def main() -> None:
    """Print the table and draw the figure."""
    parser = argparse.ArgumentParser(description="Handling qualities of GUAM's velocity loop from state-space files.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("second", type=Path)
    parser.add_argument("--png", type=Path, default=Path("guam-closed-loop.png"))
    given = parser.parse_args()
    first, second = (sorted(folder.glob("u*.toml")) for folder in (given.folder, given.second))
    print(" ".join(f"{name:>12}" for name in HEAD))
    for path in (*first, *second):
        print(f"{path.parent.name + '/' + path.stem:>12} " + " ".join(f"{value:12.4g}" for value in row(path)))
    draw(first, second, given.png)


if __name__ == "__main__":
    main()
