"""Reports on campaigns: intervals and indices against closed forms, hand-made episodes with known answers, the page."""

import json
import re
import shlex
import xml.etree.ElementTree as ET
from html.parser import HTMLParser
from itertools import product
from math import asin, inf, log10, pi

import numpy as np
import pytest
from scipy import stats

from rigs import one_line
from spherical_wrist.campaign.cluster import Cluster
from spherical_wrist.campaign.description import Campaign
from spherical_wrist.campaign.errors import CampaignError
from spherical_wrist.campaign.folder import Folder, campaign_lock
from spherical_wrist.campaign.store import encode_rows
from spherical_wrist.campaign.sweep import Listener, sweep
from spherical_wrist.errors import ParameterError, WristError
from spherical_wrist.measure.metrics import METRICS
from spherical_wrist.report.findings import findings
from spherical_wrist.report.intervals import above_worst, quantile_ranks, rank_correlation, wilson
from spherical_wrist.report.page import page
from spherical_wrist.report.parts import percent, written
from spherical_wrist.report.pictures import inline
from spherical_wrist.report.sensitivity import first_order

TEXT = """
laws = ["pd", "computed_torque"]
samples = {samples}
design = "{design}"
batch = 64
[experiment]
duration = 0.1
[vary]
mass_scale = {{ uniform = [0.5, 1.5] }}
payload = [0.0, 0.01, 0.02]
"disturbance.name" = ["constant", "sinusoid"]
"""
NARROW = TEXT.partition("payload")[0]
"""The same with one parameter, of which a page is drawn sooner."""
GRID = """
laws = ["pd"]
design = "grid"
batch = 64
[experiment]
duration = 0.1
[vary]
mass_scale = [0.5, 1.0, 1.5, 2.0]
payload = [0.0, 0.01, 0.02]
friction = [0.0, 0.001, 0.002]
"""


def handmade(path, text, row_of, batches=None):
    """A campaign whose episodes never ran: ``row_of`` gives what the row of each has besides the design."""
    file = path.with_suffix(".toml")
    file.write_text(text)
    with campaign_lock(path):
        folder = Folder.create(path, file, Campaign.from_toml(file))
    files = folder.files
    for number in range(files.count if batches is None else batches):
        batch = files.batch(number)
        rows = []
        for episode in folder.campaign.episodes(batch.first, batch.last):
            row = {"id": episode.id, "sample": episode.sample, "law": episode.law, "seed": episode.seed}
            row |= {"outcome": "completed", "ended_at_s": 0.1, "reason": "", **dict.fromkeys(METRICS)}
            rows.append(row | episode.values | row_of(episode))
        files.path(batch).write_bytes(encode_rows(folder.campaign, folder.digest, folder.versions, rows))
    return folder


def figures(error, tip=None, chattering=1.0):
    return {
        "rms_error_rad": error,
        "max_tip_error_mm": 50.0 * error if tip is None else tip,
        "chattering_Nm_per_s": chattering,
    }


LOST = {"outcome": "diverged", "ended_at_s": 0.05, "reason": "too fast"}


def noisy(episode):
    """Errors that depend on the parameters and on chance; now and then a run that diverged, failed or was invalid."""
    random = np.random.default_rng([episode.id, 7])
    size = {"pd": 3e-3, "computed_torque": 1e-3}[episode.law]
    size *= (1.0 + 30.0 * episode.values["payload"]) * episode.values["mass_scale"]
    size *= {"constant": 1.0, "sinusoid": 2.0}[episode.values["disturbance.name"]] * random.lognormal(0.0, 0.4)
    draw = random.random()
    if draw < 0.03:
        return LOST | {"ended_at_s": random.uniform(0.0, 0.1)}
    if draw < 0.05:
        return {"outcome": "failed", "ended_at_s": 0.0, "reason": "law 'pd' raised ZeroDivisionError"}
    if draw < 0.07:
        return {"outcome": "invalid", "ended_at_s": 0.0, "reason": "no"}
    return figures(size, chattering=random.uniform(0.1, 1.0))


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """A campaign of 300 samples, its rows, and what is found in it."""
    folder = handmade(tmp_path_factory.mktemp("report") / "camp", TEXT.format(samples=300, design="random"), noisy)
    rows = list(folder.episodes().in_order())
    found, curves = findings(folder, 0.1)
    return folder, rows, found, curves


@pytest.fixture(scope="module")
def shown(told):
    """The page of that campaign."""
    return page(told[2], told[3])


def errors_of(rows, law, metric="rms_error_rad"):
    """Figures of a law by sample, infinite where the run did not complete; without invalid ones."""
    return {
        row["sample"]: row[metric] if row["outcome"] == "completed" else inf
        for row in rows
        if row["law"] == law and row["outcome"] != "invalid"
    }


# --- intervals


@pytest.mark.parametrize("probability", [0.5, 0.9, 0.99])
@pytest.mark.parametrize("count", [1, 2, 7, 30, 100, 1000])
def test_ranks_are_those_of_scipy_and_numpy(probability, count):
    values = np.sort(np.random.default_rng(0).normal(size=count))
    ranks = quantile_ranks(probability, count)
    assert values[ranks.value - 1] == np.quantile(values, probability, method="inverted_cdf")
    scipy = stats.quantile_test(values, q=0.0, p=probability).confidence_interval(0.95)
    low, high = (np.nan if rank is None else values[rank - 1] for rank in ranks[1:])
    np.testing.assert_array_equal([low, high], [scipy.low, scipy.high])


@pytest.mark.parametrize(("probability", "count"), [(0.5, 50), (0.9, 200), (0.99, 500)])
def test_the_interval_of_a_quantile_covers_it_as_often_as_it_says(probability, count):
    """At least 95 %, and by the steps of the binomial distribution not much more."""
    ranks = quantile_ranks(probability, count)
    samples = np.sort(np.random.default_rng(1).exponential(size=(4000, count)))
    true = -np.log1p(-probability)
    low = samples[:, ranks.low - 1] if ranks.low else np.full(4000, -inf)
    high = samples[:, ranks.high - 1] if ranks.high else np.full(4000, inf)
    coverage = ((low <= true) & (true <= high)).mean()
    assert 0.95 - 3.0 * np.sqrt(0.05 * 0.95 / 4000) < coverage < 0.99


@pytest.mark.parametrize(("hits", "count"), [(0, 10), (1, 10), (37, 100), (100, 100)])
def test_wilson_is_the_closed_form(hits, count):
    z, p = stats.norm.ppf(0.975), hits / count
    middle = (p + z * z / (2 * count)) / (1 + z * z / count)
    half = z / (1 + z * z / count) * np.sqrt(p * (1 - p) / count + z * z / (4 * count * count))
    found = wilson(hits, count)
    assert found.value == p
    assert (found.low, found.high) == pytest.approx((max(middle - half, 0.0), min(middle + half, 1.0)), abs=1e-12)
    assert wilson(0, 0) == (None, None, None)


def test_none_of_the_samples_is_worse_with_5_percent_where_that_share_of_all_is():
    for count in (1, 59, 1000):
        assert (1.0 - above_worst(count)) ** count == pytest.approx(0.05)
    assert above_worst(59) < 0.05 < above_worst(58)  # the 59 samples of Wilks


def test_a_rank_correlation_has_scipys_p_and_an_interval_that_covers():
    """Of a bivariate normal distribution with correlation r, Spearman's ρ is 6/π · asin(r/2)."""
    random, r, count, covered = np.random.default_rng(2), 0.6, 80, 0
    for _ in range(1000):
        x = random.normal(size=count)
        y = r * x + np.sqrt(1.0 - r * r) * random.normal(size=count)
        scipy = stats.spearmanr(x, y)
        found = rank_correlation(scipy.statistic, count)
        assert found.p == pytest.approx(scipy.pvalue, rel=1e-9)
        covered += found.low <= 6.0 / pi * asin(r / 2.0) <= found.high
    assert 0.93 < covered / 1000 < 0.97
    assert rank_correlation(0.5, 3) is None
    assert rank_correlation(1.0, 10).p == 0.0


# --- sensitivities


def ishigami(x):
    """The function of Ishigami and Homma (1990) on [0, 1]³, with a = 7 and b = 0.1."""
    x = pi * (2.0 * np.asarray(x) - 1.0)
    return np.sin(x[..., 0]) + 7.0 * np.sin(x[..., 1]) ** 2 + 0.1 * x[..., 2] ** 4 * np.sin(x[..., 0])


VARIANCE = 7.0**2 / 8.0 + 0.1 * pi**4 / 5.0 + 0.1**2 * pi**8 / 18.0 + 0.5
SOBOL = [0.5 * (1.0 + 0.1 * pi**4 / 5.0) ** 2 / VARIANCE, 7.0**2 / 8.0 / VARIANCE, 0.0]
"""Its first-order indices in closed form: 0.314, 0.442, 0."""


def sums_of(x, y, bins=40, blocks=20):
    """Sums by block and bin, as the store's query gives them."""
    places = np.argsort(np.argsort(x)) * bins // len(x)
    block = np.arange(len(x)) * blocks // len(x)
    sums = np.zeros((blocks, bins, 3))
    np.add.at(sums, (block, places), np.stack([np.ones(len(x)), y, y * y], axis=-1))
    return sums


def test_indices_of_the_ishigami_function_and_their_coverage():
    random, found = np.random.default_rng(3), []
    for _ in range(150):
        x = random.random((1000, 3))
        y = ishigami(x) - 3.5
        found.append([first_order(sums_of(x[:, i], y)) for i in range(3)])
    values = np.array([[each.value for each in row] for row in found])
    np.testing.assert_allclose(values.mean(axis=0), SOBOL, atol=0.012)
    for i in (0, 1):
        covered = np.mean([row[i].low <= SOBOL[i] <= row[i].high for row in found])
        assert 0.87 < covered <= 1.0
    halves = np.mean([row[0].high - row[0].low for row in found]) / 2.0
    assert 1.5 < halves / values[:, 0].std() < 3.0  # about 2.1: Student's t of 19 degrees of freedom


def test_chance_alone_explains_nothing_but_without_the_correction_would():
    random = np.random.default_rng(4)
    sums = [sums_of(random.random(640), random.normal(size=640)) for _ in range(100)]
    assert np.mean([first_order(each).value for each in sums]) < 0.015
    assert np.mean([first_order(each, even=True).value for each in sums]) == pytest.approx(39 / 639, rel=0.1)


def test_of_a_constant_nothing_is_said():
    assert first_order(sums_of(np.arange(100.0), np.zeros(100))) == (None, None, None)


def test_indices_and_rank_correlations_through_the_store(tmp_path):
    text = """
        laws = ["pd"]
        samples = 2048
        design = "sobol"
        batch = 512
        [experiment]
        duration = 0.1
        [vary]
        mass_scale = { uniform = [1.0, 2.0] }
        friction = { uniform = [0.0, 1.0] }
        payload = { uniform = [0.0, 1.0] }
        seed = { integers = [0, 3] }
    """

    def row_of(episode):
        v = episode.values
        return figures(10.0 ** float(ishigami([v["mass_scale"] - 1.0, v["friction"], v["payload"]])))

    folder = handmade(tmp_path / "camp", text, row_of)
    told, _ = findings(folder, 0.1)
    found = {row["parameter"]: row for row in told["sensitivity"]["pd"]}
    assert set(found) == {"mass_scale", "friction", "payload"}
    for name, index in zip(found, SOBOL, strict=True):
        assert found[name]["sobol"]["value"] == pytest.approx(index, abs=0.03)
        assert found[name]["sobol"]["low"] - 0.02 <= index <= found[name]["sobol"]["high"]
        assert found[name]["episodes"] == 2048
    rows = list(folder.episodes().in_order())
    for name, row in found.items():
        scipy = stats.spearmanr([each[name] for each in rows], [each["rms_error_rad"] for each in rows])
        assert row["spearman"]["value"] == pytest.approx(scipy.statistic, abs=1e-9)
        assert row["spearman"]["p"] == pytest.approx(scipy.pvalue, rel=1e-6)


def test_of_a_grid_indices_are_exact_and_without_intervals(tmp_path):
    """log₁₀ error = mass + 100 payload + interaction: main effects of a factorial design by hand."""

    def level(mass, payload, friction):
        return mass + 100.0 * payload + 300.0 * (mass - 1.25) * (friction - 0.001)

    folder = handmade(
        tmp_path / "camp",
        GRID,
        lambda e: figures(10.0 ** level(e.values["mass_scale"], e.values["payload"], e.values["friction"])),
    )
    told, _ = findings(folder, 0.1)
    masses, payloads, frictions = [0.5, 1.0, 1.5, 2.0], [0.0, 0.01, 0.02], [0.0, 0.001, 0.002]
    total = np.var([level(*point) for point in product(masses, payloads, frictions)])
    wanted = {"mass_scale": np.var(masses) / total, "payload": np.var(payloads) * 1e4 / total, "friction": 0.0}
    for row in told["sensitivity"]["pd"]:
        assert row["sobol"]["value"] == pytest.approx(wanted[row["parameter"]], abs=1e-9)
        assert (row["sobol"]["low"], row["sobol"]["high"]) == (None, None)
    assert told["intervals"] is False
    quantiles = told["laws"]["pd"]["quantiles"]["rms_error_rad"]
    assert quantiles["median"]["low"] is quantiles["median"]["high"] is quantiles["worst"]["above"] is None
    assert told["laws"]["pd"]["rates"]["exceeding"]["low"] is None


# --- episodes with known answers


def test_counts_and_rates_are_what_counting_gives(told):
    _, rows, found, _ = told
    for law, row in found["laws"].items():
        mine = [each for each in rows if each["law"] == law]
        for outcome in ("completed", "diverged", "failed", "invalid"):
            assert row[outcome] == sum(each["outcome"] == outcome for each in mine) > 0
        assert row["episodes"] == 300
        tips = errors_of(rows, law, "max_tip_error_mm")
        assert row["measured"] == len(tips)
        beyond = sum(tip > 0.1 for tip in tips.values())
        rates = row["rates"]
        assert (rates["exceeding"]["count"], rates["exceeding"]["of"]) == (beyond, len(tips))
        assert rates["exceeding"]["share"] == beyond / len(tips)
        assert (rates["exceeding"]["low"], rates["exceeding"]["high"]) == wilson(beyond, len(tips))[1:]
        assert (rates["diverged"]["count"], rates["diverged"]["of"]) == (row["diverged"], len(tips))
        assert (rates["invalid"]["count"], rates["invalid"]["of"]) == (row["invalid"], 300)


def test_quantiles_are_those_of_all_episodes_with_lost_ones_as_the_worst(told):
    _, rows, found, _ = told
    for law, metric in product(found["laws"], ("rms_error_rad", "max_tip_error_mm", "chattering_Nm_per_s")):
        values = np.sort(list(errors_of(rows, law, metric).values()))
        quantiles = found["laws"][law]["quantiles"][metric]
        for name, probability in (("median", 0.5), ("90 %", 0.9), ("99 %", 0.99)):
            wanted = np.quantile(values, probability, method="inverted_cdf")
            assert quantiles[name]["value"] == (None if np.isinf(wanted) else wanted)
            ranks = quantile_ranks(probability, len(values))
            for end, rank in (("low", ranks.low), ("high", ranks.high)):
                wanted = inf if rank is None else values[rank - 1]
                assert quantiles[name][end] == (None if np.isinf(wanted) else wanted)
        assert quantiles["99 %"]["value"] is None  # more than one in a hundred is lost
        assert quantiles["worst"]["value"] is None


def test_pairs_are_what_comparing_sample_by_sample_gives(told):
    _, rows, found, _ = told
    errors = {law: errors_of(rows, law) for law in found["laws"]}
    assert {(pair["law"], pair["other"]) for pair in found["pairs"]} == {
        ("pd", "computed_torque"),
        ("computed_torque", "pd"),
    }
    for pair in found["pairs"]:
        a, b = errors[pair["law"]], errors[pair["other"]]
        both = sorted(a.keys() & b.keys())
        assert pair["samples"] == len(both) < 300
        assert pair["wins"] == sum(a[s] < b[s] for s in both)
        assert pair["draws"] == sum(a[s] == b[s] for s in both)
        assert pair["share"]["value"] == pair["wins"] / len(both)
        ratios = sorted(1.0 if a[s] == b[s] == inf else a[s] / b[s] for s in both)
        ranks = quantile_ranks(0.5, len(both))
        for key, rank in (("value", ranks.value), ("low", ranks.low), ("high", ranks.high)):
            assert pair["ratio"][key] == pytest.approx(ratios[rank - 1], rel=1e-12)


def test_rank_correlations_count_lost_runs_as_the_worst_and_leave_out_text(told):
    _, rows, found, _ = told
    for law, listed in found["sensitivity"].items():
        by_name = {row["parameter"]: row for row in listed}
        assert by_name["disturbance.name"]["spearman"] is None
        assert by_name["disturbance.name"]["sobol"]["value"] > 0.1
        mine = [row for row in rows if row["law"] == law and row["outcome"] != "invalid"]
        errors = [row["rms_error_rad"] if row["outcome"] == "completed" else 1e9 for row in mine]
        for name in ("mass_scale", "payload"):
            scipy = stats.spearmanr([row[name] for row in mine], errors)
            assert by_name[name]["spearman"]["value"] == pytest.approx(scipy.statistic, abs=1e-8)
        assert by_name["payload"]["episodes"] == sum(row["outcome"] == "completed" for row in mine)


def test_the_worst_are_the_lost_ones_then_the_largest_errors(tmp_path):
    def row_of(episode):
        if episode.id in (7, 20, 33):
            return LOST | {"ended_at_s": {7: 0.09, 20: 0.01, 33: 0.05}[episode.id]}
        if episode.id == 40:
            return {"outcome": "invalid", "ended_at_s": 0.0, "reason": "no"}
        return figures(1e-3 * (1 + episode.id * 37 % 101))

    folder = handmade(tmp_path / "my camp", TEXT.format(samples=50, design="random"), row_of)
    found, _ = findings(folder, 0.1)
    sizes = sorted((i for i in range(100) if i not in (7, 20, 33, 40)), key=lambda i: -(1 + i * 37 % 101))
    overall = found["worst"]["overall"]
    assert [row["id"] for row in overall] == [20, 33, 7, *sizes[:7]]
    assert [row["error"] is None for row in overall] == [True] * 3 + [False] * 7
    assert [row["id"] for row in found["worst"]["laws"]["pd"]] == [20, *[i for i in sizes if i % 2 == 0][:9]]
    assert shlex.split(overall[3]["command"]) == [
        *("wrist", "sweep", str(tmp_path / "my camp"), "--replay", str(sizes[0]), "-o", f"episode-{sizes[0]}.rrd")
    ]
    stored = folder.files.row(sizes[0])
    assert overall[3]["parameters"] == {name: stored[name] for name in ("mass_scale", "payload", "disturbance.name")}


def test_curves_and_bands_are_quantiles_of_the_episodes(told):
    _, rows, found, curves = told
    for law in found["laws"]:
        values = np.sort(list(errors_of(rows, law).values()))
        points = curves.distributions["rms_error_rad"][law]
        assert [y for _, y in points] == sorted(y for _, y in points)
        for x, y in points:
            assert x == values[round(y * len(values)) - 1]
        assert points[-1][1] == pytest.approx(np.isfinite(values).mean(), abs=0.01)
        assert points[-1][0] == values[np.isfinite(values)].max()
        mine = [row for row in rows if row["law"] == law and row["outcome"] != "invalid"]
        bands = {band["at"]: band for band in curves.bands["payload"][law]}
        assert set(bands) == {0.0, 0.01, 0.02}
        for at, band in bands.items():
            inside = [
                row["rms_error_rad"] if row["outcome"] == "completed" else inf for row in mine if row["payload"] == at
            ]
            wanted = np.quantile(inside, [0.1, 0.5, 0.9], method="inverted_cdf")
            assert [band["low"], band["median"], band["high"]] == wanted.tolist()
        masses = curves.bands["mass_scale"][law]
        assert sum(band["episodes"] for band in masses) == len(mine)
        assert min(band["episodes"] for band in masses) >= 20
        assert [band["at"] for band in masses] == sorted(band["at"] for band in masses)


def test_episodes_without_a_steady_window_are_left_out_and_told(tmp_path):
    folder = handmade(
        tmp_path / "camp",
        NARROW.format(samples=40, design="random"),
        lambda episode: {} if episode.sample < 5 else figures(1e-3),
    )
    told, curves = findings(folder, 0.1)
    assert {row["unmeasured"] for row in told["laws"].values()} == {5}
    assert {row["measured"] for row in told["laws"].values()} == {35}
    assert "10 episodes completed without a steady window" in page(told, curves)
    nothing = handmade(tmp_path / "none", NARROW.format(samples=4, design="random"), lambda episode: {})
    told, curves = findings(nothing, 0.1)
    assert told["laws"]["pd"]["quantiles"]["rms_error_rad"] == {}
    assert well_formed(page(told, curves))


def test_a_campaign_that_is_not_complete_says_so_and_damaged_files_are_left_out(tmp_path):
    folder = handmade(tmp_path / "camp", TEXT.format(samples=100, design="sobol"), noisy, batches=3)
    damaged = folder.files.path(folder.files.batch(1))
    damaged.write_bytes(damaged.read_bytes()[:-100])
    with pytest.warns(UserWarning, match=f"not trusted: {damaged.name}"):
        told, curves = findings(folder, 0.1)
    assert (told["campaign"]["stored"], told["campaign"]["episodes"], told["campaign"]["complete"]) == (128, 200, False)
    assert damaged.name in told["odd"][0]
    text = page(told, curves)
    assert "128 of 200 episodes" in text
    assert "64 % complete" in text
    assert f"wrist sweep {tmp_path / 'camp'} --resume" in text
    assert damaged.name in text


# --- the page


class Checker(HTMLParser):
    """Elements that are opened and closed in order, and what they hold."""

    VOID = ("meta", "line", "path", "use", "rect")

    def __init__(self):
        super().__init__()
        self.open, self.seen, self.data, self.ids = [], [], [], []

    def handle_starttag(self, tag, attrs):
        self.seen.append((tag, dict(attrs)))
        if tag == "data":
            self.data.append(float(dict(attrs)["value"]))
        if "id" in dict(attrs):
            self.ids.append(dict(attrs)["id"])
        if tag not in ("meta", "wbr"):
            self.open.append(tag)

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag


def well_formed(text):
    checker = Checker()
    checker.feed(text)
    checker.close()
    assert not checker.open
    return checker


def numbers_in(value):
    if isinstance(value, dict | list):
        for inner in value.values() if isinstance(value, dict) else value:
            yield from numbers_in(inner)
    elif isinstance(value, int | float):
        yield float(value)


def test_the_page_is_well_formed_and_needs_nothing_else(told, shown):
    text = shown
    checker = well_formed(text)
    assert not {"script", "link", "img", "iframe", "object", "base"} & {tag for tag, _ in checker.seen}
    assert "http" not in text
    assert "@import" not in text
    assert all(target.startswith("#") for target in re.findall(r"url\(([^)]*)\)", text))
    for tag, attributes in checker.seen:
        assert not {"src", "srcset", "onclick", "onload"} & attributes.keys()
        assert attributes.get("href", "#").startswith("#"), tag
    targets = set(re.findall(r'href="#([^"]+)"|url\(#([^)]+)\)', text))
    assert {first or second for first, second in targets} <= set(checker.ids)


def test_the_figures_of_the_page_are_those_of_the_json(told, shown):
    found, text = told[2], shown
    shown = well_formed(text).data
    known = set(numbers_in(found))
    assert set(shown) <= known
    for law in found["laws"].values():
        for metric in law["quantiles"].values():
            assert {metric["median"][key] for key in ("value", "low", "high")} <= set(shown)
        assert {law["rates"]["exceeding"][key] for key in ("share", "low", "high")} <= set(shown)
    for pair in found["pairs"]:
        assert {pair["ratio"]["value"], pair["share"]["value"]} <= set(shown)
    for row in (row for rows in found["sensitivity"].values() for row in rows):
        assert row["sobol"]["value"] in shown
    for row in found["worst"]["overall"]:
        assert row["command"].replace("'", "&#39;") in text


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"), (0.0123456, "0.0123"), (1.0, "1.00"), (123.0, "123"), (1234.0, "1234"), (-0.5, "−0.500"),
        (1.234e-4, "1.23·10<sup>−4</sup>"), (-5.6e7, "−5.60·10<sup>7</sup>"), (0.1, "0.100"),
    ],
)  # fmt: skip
def test_numbers_are_written_with_three_digits(value, text):
    assert written(value) == text
    shown = text.replace("−", "-").replace("·10<sup>", "e").replace("</sup>", "")
    assert float(shown) == pytest.approx(value, rel=5e-3)


def test_shares_are_written_so_that_almost_all_is_not_all():
    assert ">7.03 %<" in percent(0.0703125)
    assert ">100 %<" in percent(1.0)
    assert ">99.999 %<" in percent(0.99999)
    assert ">0 %<" in percent(0.0)


def test_what_comes_from_outside_is_escaped(tmp_path):
    """Labels of laws, the folder's name, the campaign file, names of damaged files and reasons of failures."""
    head = 'samples = 40  # <b>\ndesign = "random"\n[laws]\n"<i>a&b</i>" = "pd"\n"\\"q\\"" = "computed_torque"\n'
    text = NARROW.format(samples=40, design="random")

    def row_of(episode):
        return LOST | {"reason": "<u>lost</u>"} if episode.id == 3 else figures(1e-3 + episode.id)

    folder = handmade(tmp_path / "<x>&y", head + text[text.index("[experiment]") :], row_of)
    summary, curves = findings(folder, 0.1)
    shown = page({**summary, "odd": ["<em>.parquet is damaged"]}, curves)
    well_formed(shown)
    for element in ("b", "i", "x", "u", "em"):
        assert f"<{element}>" not in shown.replace("<div><b>", "")  # the cards have it
        assert f"&lt;{element}&gt;" in shown
    assert "&lt;i&gt;a&amp;b&lt;/i&gt;" in shown
    assert "&#34;q&#34;" in shown


def test_a_picture_in_the_page_takes_its_colours_and_keeps_its_text():
    drawn = (
        '<?xml version="1.0"?><!DOCTYPE svg>'
        '<svg xmlns:xlink="http://x" width="9pt" version="1.1"><metadata>x</metadata>'
        '<defs><clipPath id="used"/></defs><g id="unused" clip-path="url(#used)" style="stroke: #010203">'
        '<text style="font: 9px \'DejaVu\'; fill: #020304">0.00475</text><path d="M 1.23456 2"/></g></svg>'
    )
    tree = ET.fromstring(inline(drawn, 'a "b" <c>'))
    assert tree.get("aria-label") == 'a "b" <c>'
    assert tree.find("g").get("style") == "stroke: currentColor"
    assert tree.find("g").get("id") is None
    assert tree.find("defs/clipPath").get("id") == "used"
    assert (tree.find("g/text").text, tree.find("g/text").get("style")) == (
        "0.00475",
        "font-size: 9px; fill: var(--line)",
    )
    assert tree.find("g/path").get("d") == "M 1.23 2"


# --- the command


def test_the_command_writes_the_page_and_prints_the_same_as_json(wrist, told, shown, tmp_path):
    folder = told[0].path
    code, out, err = wrist("report", folder)
    assert (code, err) == (0, "")
    assert "600 of 600 episodes, complete" in out
    assert (folder / "report.html").read_text() == shown
    code, out, _ = wrist("report", folder, "--json", "--bound", "0.2", "-o", "other.html")
    table = json.loads(out)
    assert table["bound_mm"] == 0.2
    assert table["laws"]["pd"]["rates"]["exceeding"]["count"] < told[2]["laws"]["pd"]["rates"]["exceeding"]["count"]
    assert table["laws"]["pd"]["quantiles"] == told[2]["laws"]["pd"]["quantiles"]
    assert set(well_formed((tmp_path / "other.html").read_text()).data) <= set(numbers_in(table))
    (folder / "report.html").unlink()
    wrist("report", folder, "--json")
    assert not (folder / "report.html").exists()


def test_an_episode_replayed_as_the_report_says_is_the_stored_one(wrist, tmp_path):
    file = tmp_path / "tiny.toml"
    file.write_text(TEXT.format(samples=6, design="random"))
    with campaign_lock(tmp_path / "tiny"):
        folder = Folder.create(tmp_path / "tiny", file, Campaign.from_toml(file))
        sweep(folder, Cluster(workers=0, threads=1), Listener())
    code, out, _ = wrist("report", "tiny", "--json")
    worst = json.loads(out)["worst"]["overall"][0]
    code, out, _ = wrist(*shlex.split(worst["command"])[1:], "--json")
    assert code == 0
    again = json.loads(out)
    assert (
        again["metrics"]["rms_error_rad"]
        == worst["error"]
        == max(row["rms_error_rad"] for row in folder.episodes().in_order())
    )
    assert again["differences"] == []
    assert (tmp_path / f"episode-{worst['id']}.rrd").is_file()


def test_wrong_input_gives_one_line(wrist, told, tmp_path):
    empty = handmade(tmp_path / "empty", TEXT.format(samples=4, design="random"), noisy, batches=0)
    with pytest.raises(CampaignError, match="no episodes yet") as caught:
        findings(empty, 0.1)
    assert "--resume" in one_line(caught.value)
    for bound in (0.0, -1.0, inf, float("nan")):
        with pytest.raises(ParameterError, match="--bound"):
            findings(told[0], bound)
    for arguments in (
        ["nowhere"],
        [tmp_path],
        [empty.path],
        [told[0].path, "--bound", "0"],
        [told[0].path, "-o", "no/such/folder/page.html"],
    ):
        code, out, err = wrist("report", *arguments)
        assert (code, out) == (2, "")
        assert len(err.splitlines()) == 1
        assert issubclass(CampaignError, WristError)


def test_the_answers_do_not_change_with_the_size_of_batches(tmp_path, told):
    text = TEXT.format(samples=300, design="random").replace("batch = 64", "batch = 7")
    found, _ = findings(handmade(tmp_path / "camp", text, noisy), 0.1)
    for key in ("laws", "pairs", "sensitivity"):
        assert found[key] == told[2][key]


def test_log_errors_are_what_indices_explain(tmp_path):
    """Two levels of one parameter, ten times the error on the upper one, times chance of a known variance."""
    random = np.random.default_rng(5)
    noise = random.choice([-0.25, 0.25], size=4000)
    text = (
        'laws = ["pd"]\nsamples = 4000\ndesign = "random"\n[experiment]\nduration = 0.1\n[vary]\npayload = [0.0, 0.01]'
    )
    folder = handmade(
        tmp_path / "camp", text, lambda e: figures(10.0 ** ((e.values["payload"] > 0.0) + noise[e.sample] - 3.0))
    )
    found, _ = findings(folder, 0.1)
    (row,) = found["sensitivity"]["pd"]
    assert row["sobol"]["value"] == pytest.approx(0.25 / (0.25 + 0.25**2), abs=0.01)
    assert log10(found["laws"]["pd"]["quantiles"]["rms_error_rad"]["worst"]["value"]) == pytest.approx(-1.75)
