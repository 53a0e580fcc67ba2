"""Makes the table and the figure of the page "What happens on a real arm": `page.py [--goals N] [--figure FILE]`. The figure needs matplotlib."""

import argparse
from dataclasses import replace

import numpy as np
import rows


def span(values, digits):
    """The smallest and the largest value."""
    least, most = f"{min(values):.{digits}f}", f"{max(values):.{digits}f}"
    return least if least == most else f"{least} to {most}"


def line(row, goals):
    results = [rows.run(row, number)[0] for number in range(goals)]
    there = [result for result in results if result.settled is not None]
    return [
        row.name,
        f"{len(there)} of {goals}",
        span([result.settled for result in there], 2) if there else "",
        span([1e3 * result.error for result in results], 3),
        f"{1e3 * max(result.overshoot for result in results):.1f}",
        f"{100 * max(result.torque for result in results):.0f}",
    ]


def table(goals):
    print("| | arrived | settled [s] | error at the end [mm] | overshoot [mm] | torque [%] |\n|---|---:|---:|---:|---:|---:|")
    for row in rows.ROWS:
        print("| " + " | ".join(line(row, goals)) + " |", flush=True)


def figure(path):
    import matplotlib.pyplot as plt

    plots, axes = plt.subplots(2, 2, figsize=(10, 6), sharex=True, sharey="row")
    for column, (payload, parameters) in enumerate([(0.0, {}), (2.0, {}), (2.0, rows.HELD)]):
        for law, color in [("logc", "C0"), ("diffc", "C1"), ("logc_pd", "C2")]:
            row = rows.Row("", replace(rows.UR5E, payload=payload), {"controller": law} | parameters)
            _, seen = rows.run(row, 1)
            held = ", integral" if parameters else ""
            style = {"color": color, "linestyle": "--" if parameters else "-", "label": law + held}
            times, side = seen.array("times") - 0.5, min(column, 1)
            axes[0, side].semilogy(times, 1e3 * np.maximum(seen.array("errors"), 1e-7), **style)
            axes[1, side].plot(times, seen.array("torques")[:, 1], **style)
    for side, title in enumerate(["without payload", "with 2 kg that nobody told the arm of"]):
        axes[0, side].axhline(1.0, color="gray", linewidth=0.8)
        axes[0, side].set(title=title, ylim=(1e-3, 1e3))
        axes[1, side].set(xlabel="time [s]", xlim=(0, 7))
        axes[0, side].legend()
    axes[0, 0].set_ylabel("distance to the goal [mm]")
    axes[1, 0].set_ylabel("torque of the second joint's servo,\nbesides compensation [Nm]")
    plots.tight_layout()
    plots.savefig(path, dpi=110)


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--goals", type=int, default=8)
    parser.add_argument("--figure")
    given = parser.parse_args()
    table(given.goals)
    if given.figure:
        figure(given.figure)


if __name__ == "__main__":
    main()
