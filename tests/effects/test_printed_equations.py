"""The equations that are printed are those of the form chosen, in symbols that mean one thing each."""

from __future__ import annotations

import itertools
from functools import cache
from typing import Any, ClassVar

import jax.numpy as jnp
import numpy as np
import pytest
from jax import Array
from matplotlib.mathtext import MathTextParser

from stickslip.cli import run
from stickslip.errors import InputError
from stickslip.physics.contact import Bank, normal_scores, power_law_bank
from stickslip.physics.effects import catalogue
from stickslip.physics.effects.base import BodyForce, Contact, Effect, Motion
from stickslip.physics.effects.effects_from_text import effects_of
from stickslip.physics.effects.equation_text import pieces
from stickslip.physics.effects.equations import PowerLaw, equations, of_tags
from stickslip.physics.effects.latex_to_text import plain
from stickslip.physics.effects.symbols import distinct, found, marks, of_parameters, replaced, subscripted
from stickslip.physics.model import Block, Weakening
from stickslip.physics.params import parameter, specs

# tag and form -> what the printed law must say (with a ¬: must not say)
TOLD: dict[tuple[str, ...], tuple[str, ...]] = {
    ("adhesion",): ("c_i + ε F_s k_i/Σ_j k_j", "F_s → (1 + ε) F_s"),
    ("base-vibration",): ("-m a_b sin(2π f t + φ)",),
    ("contact-ageing",): ("1 + β ln(1 + θ/t_0)", "θ' = 1 - |x'| θ/D", "θ(0) = θ_1"),
    ("contact-damping",): ("-η x' Σ_(|f_i| < C_i) k_i",),
    ("contact-renewal",): ("∂_t g_i + |x'| ∂_a g_i = k_i x'", "|g_i| ≤ C_i", "e^(-a/l)"),
    ("curvature",): ("(1-ε) u_i + ε (3 F_s)/(2 k) (1 - Q_i^2)", "Q_i = Σ_(u_j > u_i) k_j/k"),
    ("direct-effect", "shifted"): ("a ln(1 + |x'|/v^*)", "¬asinh"),
    ("direct-effect", "asinh"): ("a asinh(|x'|/(2 v^*))", "¬ln("),
    ("drive-ripple",): ("x_0 + ε [sin(2π s/l + φ) - sin(φ)]",),
    ("flash-heating",): ("μ e^(-χ P)", "τ P' = F_s|x'| - P"),
    ("inertia",): ("m → m (1 + α)",),
    ("load-modulation",): ("C_i [1 + ε sin(2π f t + φ)]",),
    ("machine-compliance", "read-out"): ("y → y + Σ_i f_i/k_m", "¬u_i"),
    ("machine-compliance", "series"): (
        "x_c = x - Σ_i f_i/k_m",
        "u_i → u_i + F(u_i)/k_m",
        "K_i = Σ_(u_j ≥ u_i) k_j",
        "¬y",
    ),
    ("measured-load",): ("μ [1 + s (N/N_m - 1)]",),
    ("nonlinear-spring", "quadratic"): ("F_spring [1 + β (x_0 - x)]",),
    ("nonlinear-spring", "cubic"): ("F_spring [1 + β (x_0 - x)^2/(0.1 mm)]",),
    ("plasticity",): ("[1 + (h u_i/max_j u_j)^n]^(-1/n)", "Σ_i c_i = F_s"),
    ("position-dependent-friction", "wave"): ("ε sin(2π x/λ + φ)", "¬e^"),
    ("position-dependent-friction", "trend"): ("μ e^(ε x/λ)", "¬sin"),
    ("rate-and-state", "ageing"): ("a ln(V/v^*) + b ln(v^* θ/L)", "V = |x'| + v^*", "θ' = 1 - V θ/L"),
    ("rate-and-state", "slip"): ("a ln(V/v^*) + b ln(v^* θ/L)", "V = |x'| + v^*", "θ' = -(V θ/L) ln(V θ/L)"),
    ("residual-load",): ("f_i' + f_i ln(1-ε) max(-q', 0)", "q' = |x'| (1-q)/l - s q/τ_a"),
    ("roll-off",): ("(1-ε) u_i - ε F_s/k ln Q_i",),
    ("sensor-drift",): ("y → y + ε t",),
    ("sensor-gain",): ("y → (1 + γ) y",),
    ("sensor-high-pass",): ("y → y - s", "s' = 2π f_c (x - s)"),
    ("sensor-low-pass",): ("y → y - δ", "δ' = x' - δ/τ"),
    ("slip-weakening",): ("1 - ε (1 - e^(-s_i/D_s))", "|x'| (sliding)", "-|x'| s_i/l_h (stuck)"),
    ("thermal-creep",): ("f_i' - 2 k_i v_1 e^(-1/α) sinh(f_i/(α C_i))",),
    ("tilt", "spring"): ("κ F_spring/F_s", "¬f_j"),
    ("tilt", "contact"): ("κ Σ_j f_j/F_s", "¬F_spring"),
    ("uneven-compliance",): ("y → y + β (Σ_i f_i)^2",),
    ("unequal-contacts",): ("u_i e^(σ z_(j(i)))", "k_i e^(-σ z_(j(i)))"),
    ("velocity-weakening", "exponential"): ("ε (1 - e^(-s))", "(x'^2/v_s^2 + 10^(-6))^(q/2)"),
    ("velocity-weakening", "hyperbolic"): ("ε s/(1 + s)", "(x'^2/v_s^2 + 10^(-6))^(q/2)", "¬e^"),
    ("viscoelastic-contact", "renewed"): ("g k_i δ_i' - h_i/τ", "(g f_i - h_i) |x' - δ_i'|/l"),
    ("viscoelastic-contact", "kept"): ("g k_i δ_i' - h_i/τ", "¬/l"),
    ("viscous-drag",): ("-F_1 (x'/v_1) [(x'^2 + v_r^2)/v_1^2]^((q-1)/2)", "v_1 = 1 mm/s"),
    ("wandering-friction", "place", "both"): ("μ → μ e^w", "cos(q_j s/l + φ_j + n γ_j)", "s = x"),
    ("wandering-friction", "slip", "both"): ("μ → μ e^w", "cos(q_j s/l + φ_j + n γ_j)", "s' = |x'|"),
    ("wandering-friction", "time", "both"): ("μ → μ e^w", "cos(q_j s/τ + φ_j + n γ_j)", "s = t"),
    ("wandering-friction", "place", "static"): ("μ → μ + μ_s ψ (e^w - 1)", "s = x"),
    ("wandering-friction", "slip", "static"): ("μ → μ + μ_s ψ (e^w - 1)", "s' = |x'|"),
    ("wandering-friction", "time", "static"): ("μ → μ + μ_s ψ (e^w - 1)", "s = t"),
    ("wandering-friction", "place", "sliding"): ("μ → μ + μ_k (1 - ψ) (e^w - 1)", "s = x"),
    ("wandering-friction", "slip", "sliding"): ("μ → μ + μ_k (1 - ψ) (e^w - 1)", "s' = |x'|"),
    ("wandering-friction", "time", "sliding"): ("μ → μ + μ_k (1 - ψ) (e^w - 1)", "s = t"),
    ("wear", "friction", "linear"): ("μ → μ w", "w = max(1 + ε g, 0.01)", "g = s/s_1", "¬u_i"),
    ("wear", "friction", "logarithmic"): ("μ → μ w", "w = max(1 + ε g, 0.01)", "g = ln(1 + s/s_1)", "¬u_i"),
    ("wear", "friction", "saturating"): ("μ → μ w", "w = max(1 + ε g, 0.01)", "g = 1 - e^(-s/s_1)", "¬u_i"),
    ("wear", "thresholds", "linear"): ("u_i → u_i w", "k_i → k_i/w", "g = s/s_1", "¬μ"),
    ("wear", "thresholds", "logarithmic"): ("u_i → u_i w", "k_i → k_i/w", "g = ln(1 + s/s_1)", "¬μ"),
    ("wear", "thresholds", "saturating"): ("u_i → u_i w", "k_i → k_i/w", "g = 1 - e^(-s/s_1)", "¬μ"),
}


@cache
def every_form() -> dict[tuple[str, ...], Effect]:
    """Tag and form -> the effect."""
    return {
        (tag, *form.values()): catalogue.make(tag, **form)
        for tag in catalogue.EFFECTS.names()
        for form in catalogue.forms(catalogue.get(tag))
    }


def printed(effect: Effect) -> str:
    """The law alone, as it stands in a printed model."""
    return "\n".join(plain(part) for part in pieces(effect.formula()))


def parse(latex: str) -> None:
    """Refuse what is no formula."""
    MathTextParser("path").parse(f"${latex}$".replace(r"\le ", r"\leq ").replace(r"\ge ", r"\geq "))


def test_every_form_is_told() -> None:
    assert set(TOLD) == set(every_form())


@pytest.mark.parametrize("key", list(TOLD), ids="-".join)
def test_the_law_is_that_of_the_form(key: tuple[str, ...]) -> None:
    law = printed(every_form()[key])
    for words in TOLD[key]:
        assert (words[1:] not in law) if words[0] == "¬" else (words in law), (words, law)


def test_no_two_forms_print_the_same() -> None:
    laws = [(key[0], printed(effect)) for key, effect in every_form().items()]
    assert len(set(laws)) == len(laws)


def test_every_parameter_stands_in_a_law() -> None:
    """Also those of a state's start: what is in no equation would have no meaning to a reader."""
    for tag in catalogue.EFFECTS.names():
        shown = {s for key, effect in every_form().items() if key[0] == tag for s in found(effect.formula())}
        assert of_parameters(catalogue.get(tag)) <= shown, tag


def test_what_is_chosen_is_what_is_printed() -> None:
    words = ["static", "inertia", "machine-compliance:where=series", "rate-and-state:law=slip:evolution=0.01"]
    found_in = of_tags([*words, "drive-ripple:pitch=2 mm"], block=Block(), weakening=Weakening())
    text = found_in.text()
    rows = {r.name: r.value for r in found_in.rows}
    assert rows["rate-and-state.evolution"] == 0.01
    assert rows["drive-ripple.pitch"] == 2e-3
    for line in ("    θ' = -(V θ/L) ln(V θ/L)\n", "machine-compliance (where = series):\n", "law = slip):\n"):
        assert line in text
    assert "1 - V" not in text
    assert "reading of the sensor" not in text, "a fixture in series with the contact changes no reading"
    assert "y = x" in of_tags(["static", "inertia", "machine-compliance"]).text()


def test_the_inertia_of_the_block_is_no_effect() -> None:
    """The title of a fit is ``static + inertia + ...``, and mass that moves with the block is an effect besides."""
    assert effects_of(["static", "inertia"]) == ([], True)
    assert [e.tag for e in effects_of(["static", "inertia", "tilt"])[0]] == ["tilt"]
    assert "m → m" not in of_tags(["static", "inertia", "contact-ageing"]).text()
    for words in (["inertia", "inertia:share=0.05"], ["inertia:share=0.05"], ["inertia:share=0.05", "inertia"]):
        (effect,), inertial = effects_of(["static", *words])
        assert (effect.tag, float(effect.share), inertial) == ("inertia", 0.05, True)
    assert "m → m (1 + α)" in of_tags(["static", "inertia", "inertia"]).text()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ([], "no model is named"),
        (["", " "], "no model is named.*static,inertia"),
        (["statc"], "did you mean 'static'"),
        (["static", "inertia", "weer:course=linear"], "did you mean 'wear'"),
        (["static", "contact-ageing"], r"(?s)include inertia.*--model static,inertia,contact-ageing"),
        (["contact-ageing"], r"(?s)include inertia.*--model static,inertia,contact-ageing"),
        (["static", "inertia", "tilt", "tilt"], "twice"),
        (["static", "inertia", "inertia", "inertia"], "twice"),
        (["static", "inertia", "tilt:by=spring:by=contact"], "twice"),
        (["static:p=3"], "no forms or parameters"),
        (["static", "inertia", "tilt:by"], "by=contact"),
        (["static", "inertia", "tilt:=3"], "tilt:name=value"),
        (["static", "inertia", "tilt:by=weight"], "spring, contact"),
        (["static", "inertia", "tilt:copling=0.1"], "did you mean 'coupling'"),
        (["static", "inertia", "tilt:coupling=7"], r"-0\.3 \.\.\. 0\.3"),
        (["static", "inertia", "drive-ripple:pitch=2 s"], r"drive-ripple\.pitch"),
    ],
)
def test_what_cannot_be_chosen_is_said(words: list[str], message: str) -> None:
    with pytest.raises(InputError, match=f"(?s){message}"):
        effects_of(words)


def test_the_commands_say_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["effects", "--model", "static,inertia,velocity-weakening:form=hyperbolic"]) == 0
    assert "    μ → μ [1 - ε s/(1 + s)]\n" in capsys.readouterr().out
    for words, message in (
        ("", "no model is named"),
        ("static,contact-ageing", "static,inertia,contact-ageing"),
        ("static,inertia,my-effect", "one of your own needs --effect FILE.py"),
    ):
        assert run(["effects", "--model", words]) == 2
        assert message in capsys.readouterr().err
    assert run(["effects", "rate-and-state"]) == 0
    told = capsys.readouterr().out
    slip = told[told.index("law = slip:") :]
    assert "θ' = -(V θ/L) ln(V θ/L)\n" in slip and "θ' = 1 - V θ/L\n" in told[told.index("law = ageing") : -len(slip)]
    assert "; prior: log-normal around 2e-06 m, factor 25.1\n" in told


def test_papers_are_named_from_which_the_laws_are() -> None:
    """What one cites who publishes a fit: of every part of the model, and of no other effect."""
    words = of_tags(["static", "inertia", "wear", "contact-ageing"])
    told = dict(words.sources)
    assert list(told) == ["contact", "elements", "wear", "contact-ageing"] and "Grzemba" in told["contact"]
    for tag in ("wear", "contact-ageing"):
        assert told[tag] == catalogue.get(tag).source
    text = words.text().partition("\nSources:\n")[2].splitlines()
    assert [line.split()[0] for line in text] == list(told)
    assert r"\item contact-ageing: Dieterich, J. Geophys. Res. 77 (1972) 3690" in words.latex()
    assert r"Baumberger \& Caroli" in words.latex()


@pytest.mark.slow
def test_one_symbol_one_meaning() -> None:
    """In every model of two effects, whatever their forms, also where two LaTeX commands print the same letter."""
    block, weakening = Block(), Weakening()
    everything = every_form()
    for (a, one), (b, two) in itertools.combinations(everything.items(), 2):
        if a[0] == b[0]:
            continue
        model = equations((one, two), block=block, weakening=weakening, contact=PowerLaw())
        rows = [plain(r.symbol) for r in model.rows]
        assert len(set(rows)) == len(rows), (a, b, sorted(s for s in rows if rows.count(s) > 1))
        of_rows = [s for r in model.rows for s in found(r.symbol)]
        other = [s for s, _ in model.symbols]
        assert not set(other) & set(of_rows), (a, b)
        letters = [plain(s) for s in dict.fromkeys([*of_rows, *other])]
        assert len(set(letters)) == len(letters), (a, b, sorted(s for s in letters if letters.count(s) > 1))
        said = {s for line in model.lines for s in found(line.latex)}
        unknown = said - set(of_rows) - set(other) - {"u_{i-1}", "u_{i+1}"}
        assert not unknown, (a, b, unknown)


def test_what_acts_on_the_block_stands_in_its_balance() -> None:
    ageing, drag, damping = (catalogue.make(tag) for tag in ("contact-ageing", "viscous-drag", "contact-damping"))
    lines = {line.title.split(" (")[0]: plain(line.latex) for line in equations((ageing, drag, damping)).lines}
    assert lines["balance of the block"].endswith("+ F_vd + F_cd")
    assert lines["viscous-drag"].startswith("F_vd = -F_1 ")
    assert lines["contact-damping"].startswith("F_cd = -η ")


class Push(BodyForce):
    """A user's effect: no symbols declared, one parameter without any."""

    tag: ClassVar[str] = "my-push"
    summary: ClassVar[str] = "a push"
    equation: ClassVar[str] = r"F = \varepsilon\,\sin(2\pi x/\ell)"
    amplitude: ClassVar[str] = "size"
    size: Array = parameter(0.0, unit="N", lower=-1.0, upper=1.0, null=0.0, doc="push", symbol=r"\varepsilon")
    length: Array = parameter(1e-3, unit="m", lower=1e-4, upper=1.0, doc="length", symbol=r"\ell")
    other_size: Array = parameter(1.0, unit="1", lower=0.0, upper=2.0, doc="another")

    def force(self, state: Any, motion: Motion, contact: Contact) -> Array:
        return self.size * jnp.sin(2 * np.pi * motion.x / self.length)


def test_a_users_symbols_are_kept_apart_too() -> None:
    model = equations((Push(), catalogue.make("drive-ripple"), Push()))
    lines = [plain(line.latex) for line in model.lines]
    assert "F_mp1 = ε_mp1 sin(2π x/l_mp1)" in lines and "F_mp2 = ε_mp2 sin(2π x/l_mp2)" in lines
    assert "x_0 → x_0 + ε_dr [sin(2π s/l_dr + φ) - sin(φ)]" in lines
    symbols = [r.symbol for r in model.rows]
    assert len(set(symbols)) == len(symbols) == 9
    assert any("F_" in s and m == "force on the block (N)" for s, m in model.symbols)


def test_symbols_are_found_and_written_otherwise() -> None:
    latex = (
        r"\dot f_i = \mathrm{sign}(v^*)\,\frac{\ell_{h}}{\theta}\,e^{-x_{1}/D_c}\,dt,\quad u_{\mathrm{max}} = \sum_i u"
    )
    assert found(latex) == ["f_i", "v^*", r"\ell_h", r"\theta", "x_1", "D_c", "t", r"u_{\mathrm{max}}", "u"]
    changed = replaced(latex, {s: subscripted(s, "w") for s in ("v^*", r"\theta", "x_1", "D_c")})
    for part in (
        r"v^*_{\mathrm{w}}",
        r"\theta_{\mathrm{w}}}",
        r"x_{1,\mathrm{w}}/D_{c,\mathrm{w}}",
        r"\dot f_i",
        "sign",
    ):
        assert part in changed
    assert plain(changed).startswith("f_i' = sign(v^*_w) ")
    assert marks([catalogue.make(t) for t in ("tilt", "wear", "sensor-gain")]) == ["tilt", "wear", "sg"]
    assert marks([catalogue.make(t) for t in ("sensor-gain", "sensor-gain")]) == ["sg1", "sg2"]
    assert marks([catalogue.make("wear"), Push(), type("Other", (Push,), {"tag": "mud-pie"})()])[1:] == [
        "my-push",
        "mud-pie",
    ]
    assert distinct([catalogue.make("tilt"), catalogue.make("wear")]) == [{}, {}]


@pytest.mark.slow
@pytest.mark.parametrize("key", TOLD, ids="-".join)
def test_every_formula_can_be_shown(key: tuple[str, ...]) -> None:
    """As text and as LaTeX: the overview, the law of the form, and the model it stands in, symbols made distinct."""
    effect = every_form()[key]
    twin = (effect, Push(), effect)
    model = equations(twin, block=Block(), weakening=Weakening(), contact=PowerLaw())
    formulas = [
        effect.equation,
        effect.formula(),
        *(line.latex for line in model.lines),
        *(r.symbol for r in model.rows),
    ]
    for latex in formulas:
        shown = plain(latex)
        assert "\\" not in shown and "frac" not in shown and not set("{}") & set(shown), shown
        assert shown.count("(") == shown.count(")") and shown.count("[") == shown.count("]"), shown
        parse(latex)
    latex = model.latex()
    for group in ("align*", "tabular"):
        assert latex.count(rf"\begin{{{group}}}") == latex.count(rf"\end{{{group}}}") == (1 if group == "align*" else 2)
    assert latex.count("{") == latex.count("}")
    body = latex[latex.index("\n") : latex.index(r"\end{align*}")].strip().splitlines()
    assert len(body) == len(model.lines) and all(line.endswith(r"\\") for line in body)


def test_contact_numbers_are_shown() -> None:
    text = of_tags(["static"], block=Block(), weakening=Weakening()).text()
    for name in ("strength", "u_max", "p", "spread", "contacts", "elements"):
        assert f"contact.{name} " in text
    assert "Σ_j [1 - (1 - u/U_j)^p]" in text and "w_i = (3 - sqrt(9 - 8 i/N_e))/2" in text
    assert "c_i = k_i u_i" in text


# --- the printed equations of the bank are what the program makes -------------------------------------------------


def law_of(contact: PowerLaw) -> tuple[np.ndarray, np.ndarray]:
    """Stiffnesses (N/m) and thresholds (m) of the elements, from the printed equations."""
    reach = contact.u_max * np.exp(contact.spread * normal_scores(contact.contacts))

    def force(u: np.ndarray) -> np.ndarray:
        inside = np.clip(1.0 - u[:, None] / reach, 0.0, 1.0)  # beyond U_j all of a contact slides
        return contact.strength / contact.contacts * np.sum(1.0 - inside**contact.p, axis=1)

    i = np.arange(1, contact.elements + 1)
    u = (3.0 - np.sqrt(9.0 - 8.0 * i / contact.elements)) / 2.0 * reach.max()
    padded = np.concatenate([[0.0], u, [2.0 * u[-1]]])
    slope = np.diff(force(padded)) / np.diff(padded)
    return slope[:-1] - slope[1:], u


def test_elements_are_made_as_printed() -> None:
    contact = PowerLaw(spread=0.2, elements=24)
    bank = power_law_bank(
        contact.strength, contact.u_max, contact.p, contact.spread, contact.contacts, contact.elements
    )
    stiffness, threshold = law_of(contact)
    np.testing.assert_allclose(np.asarray(bank.stiffness), stiffness, rtol=1e-9)
    np.testing.assert_allclose(np.asarray(bank.threshold), threshold, rtol=1e-9)


@pytest.fixture(scope="module")
def bank() -> Bank:
    return power_law_bank(0.26, 0.95e-6, 3.6, n=24)


def test_a_fixture_in_series_is_made_as_printed(bank: Bank) -> None:
    compliance = 2e-7
    made = catalogue.make("machine-compliance", where="series", compliance=compliance).reshape(bank)  # type: ignore[attr-defined]
    k, u = np.asarray(bank.stiffness), np.asarray(bank.threshold)
    sticking = np.array([k[u >= one].sum() for one in u])
    np.testing.assert_allclose(made.threshold, u + np.asarray(bank.backbone(u)) * compliance, rtol=1e-12)
    soft = (1 + sticking * compliance) * (1 + (sticking - k) * compliance)
    np.testing.assert_allclose(made.stiffness, k / soft, rtol=1e-12)


def test_shapes_are_made_as_printed(bank: Bank) -> None:
    """Curvature and roll-off, with the mean over an element of what its share Q of the stiffness runs through."""
    k, u = np.asarray(bank.stiffness), np.asarray(bank.threshold)
    strength, total = float(bank.total_strength), k.sum()
    after = np.array([k[u > one].sum() for one in u]) / total
    q = after[:, None] + (k / total)[:, None] * (np.arange(4000) + 0.5) / 4000
    curved = 0.7 * u + 0.3 * 1.5 * strength / total * (1.0 - np.mean(q**2, axis=1))
    rolled = 0.7 * u - 0.3 * strength / total * np.mean(np.log(q), axis=1)
    for tag, wanted in (("curvature", curved), ("roll-off", rolled)):
        made = catalogue.make(tag, share=0.3).reshape(bank)  # type: ignore[attr-defined]
        np.testing.assert_allclose(made.threshold, wanted, rtol=1e-3)
        np.testing.assert_allclose(made.stiffness, k, rtol=1e-12)


def test_the_form_decides_about_the_parameters_that_are_listed_nowhere_else() -> None:
    """Every parameter of an effect has its row, with the unit and words of its class."""
    for effect in every_form().values():
        rows = {r.name: r for r in equations((effect,)).rows}
        for name, spec in specs(effect).items():
            row = rows[f"{effect.tag}.{name}"]
            assert (row.unit, row.doc) == (spec.unit, spec.doc)
