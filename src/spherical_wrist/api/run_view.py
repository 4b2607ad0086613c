"""View of a run."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from spherical_wrist.api.view import Content, View, as_json, library
from spherical_wrist.channels import WXYZ, XYZ
from spherical_wrist.colours import GREY, INK
from spherical_wrist.inspection.columns import columns
from spherical_wrist.inspection.curves import drawable
from spherical_wrist.inspection.drawing import STYLE, fit, fit_decades, line, lines, name
from spherical_wrist.inspection.export import exported
from spherical_wrist.inspection.formats import EXPORTS
from spherical_wrist.inspection.picture import WIDTH, run_picture
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.recording.experiment_text import title
from spherical_wrist.recording.runs import record
from spherical_wrist.result_table import Column, ResultTable
from spherical_wrist.simulation.run import Run

DIMENSIONS: Mapping[tuple[str, ...], str] = {XYZ: "axis", WXYZ: "component"}
"""Names of the second dimension of channels by their components; others are named after the channel."""


class RunView(View[Run]):
    """View of a run: metrics, error and torque over time; the inspection sheet as its picture."""

    keys = ("time",)
    usual_width = WIDTH

    def notes(self) -> list[str]:
        """Return the warnings of the run."""
        return [f"warning: {warning}" for warning in self.result.warnings]

    def summary(self) -> ResultTable:
        """Return the metrics."""
        rows = [
            (METRICS[name].label, METRICS[name].shown_value(value), METRICS[name].shown_unit)
            for name, value in self.result.metrics.available.items()
        ]
        columns = (Column("metric", text=True), Column("value"), Column("unit", text=True))
        return ResultTable(self.result.headline(), columns, rows, notes=self.notes())

    def figure(self) -> Figure:
        """Draw the inspection sheet; an empty figure of a run without series."""
        if not len(self.result):
            return Figure(figsize=(self.width, 1.0))
        verdict = str(self.result.verdict)
        names = self.result.headline().removesuffix(f": {verdict}")
        return run_picture(self.result, [names, verdict, *self.notes()], self.width)

    def small_figure(self) -> Figure:
        """Draw tip error and torque over time."""
        run = self.result
        if not len(run):
            return self.figure()
        with mpl.rc_context(STYLE):
            drawing = Figure(figsize=(9.0, 2.3), layout="constrained")
            tip, torque = drawing.subplots(1, 2)
            size = np.linalg.norm(drawable(1e3 * (run.tip - run.desired_tip)), axis=1)
            line(tip, run.time, size, color=INK)
            fit_decades(tip, size)
            bound = run.measurement.bound
            tip.axhline(bound, color=GREY, linestyle="--", linewidth=1.2)
            tip.set(xlabel="time [s]", ylabel="|Δp| [mm]")
            name(tip, "Tip error", f"dashed: {bound:g} mm")
            lines(torque, run.time, run.torque)
            fit(torque, run.torque)
            torque.set(xlabel="time [s]", ylabel="τ [N·m]")
            name(torque, "Torque", "x red · y green · z blue")
        return drawing

    def rows(self) -> list[dict[str, Any]]:
        """Return the series, a row for each control instant that is kept."""
        found = {column.name: column.values.tolist() for column in columns(self.result)}
        return [dict(zip(found, values, strict=True)) for values in zip(*found.values(), strict=True)]

    def units(self) -> dict[str, str]:
        """Return the unit of each column that has one."""
        return {column.name: column.unit for column in columns(self.result) if column.unit}

    def files(self) -> dict[str, Callable[[Path], Content]]:
        """Return recording, exports and pictures."""
        exports: dict[str, Callable[[Path], Content]] = dict.fromkeys(EXPORTS, lambda path: exported(self.result, path))
        own: dict[str, Callable[[Path], Content]] = {".rrd": lambda path: b""}  # which record writes
        return {**own, **super().files(), **exports, ".json": lambda path: as_json(self._description())}

    def save(self, path: Path) -> Path:
        """Write a recording (``.rrd``), an export or a picture."""
        if path.suffix.lower() == ".rrd":
            record(self.result, path)
            return path
        return super().save(path)

    def _description(self) -> dict[str, Any]:
        run = self.result
        return {
            "experiment": run.description,
            "outcome": {"status": str(run.outcome.status), "time_s": run.outcome.time, "reason": run.outcome.reason},
            **run.verdict.to_dict(),
            "warnings": list(run.warnings),
            "metrics": dict(run.metrics),
            "versions": run.versions,
        }

    def to_pandas(self) -> Any:
        """Return the series as a data frame by time, with the columns of an export."""
        found = list(columns(self.result))
        time, *others = found
        frame = library("pandas").DataFrame({column.name: column.values for column in others})
        frame.index = library("pandas").Index(time.values, name=time.name)
        frame.attrs["units"] = self.units()
        return frame

    def to_xarray(self) -> Any:
        """Return the channels as a data set over time, with components as the second dimension."""
        run, xarray = self.result, library("xarray")
        variables: dict[str, Any] = {}
        coordinates: dict[str, Any] = {}
        for each, array in run.channels.items():
            channel, about = run.channel(each), {"long_name": run.channel(each).meaning}
            if channel.unit:
                about["units"] = channel.unit
            if array.ndim == 1:
                variables[each] = (("time",), array, about)
                continue
            components = tuple(channel.components(array.shape[1]))
            dimension = DIMENSIONS.get(components, f"{each}_component")
            coordinates[dimension] = list(components)
            variables[each] = (("time", dimension), array, about)
        coordinates["time"] = variables.pop("time")
        metrics = {each: value for each, value in run.metrics.items() if value is not None}
        return xarray.Dataset(variables, coordinates, {"title": title(run.description), **metrics})
