// The catalogue: one line for each effect. Everything from elsewhere is set as text, never as HTML.
const EVIDENCE = "by how much the cost (chi-square, no unit) falls: promised by a small amplitude, nothing fitted, or gained " +
  "when the effect was fitted; on runs that had no part in its amplitude it must fall too"
const SVG = "http://www.w3.org/2000/svg"

function curve(parent, points, classes) {
  const line = document.createElementNS(SVG, "polyline")
  line.setAttribute("points", points.map(([x, y]) => `${(110 * x + 2).toFixed(1)},${(36 * (1 - y) + 2).toFixed(1)}`).join(" "))
  line.setAttribute("class", classes)
  parent.append(line)
}

export function render({ model }) {
  const root = document.createElement("div")
  root.className = "catalogue"
  const update = () => {
    root.replaceChildren()
    for (const row of model.rows) {
      const line = part("div", "effect-row" + (row.on ? " on" : "") + (row.chosen ? " chosen" : ""), root)
      line.dataset.tag = row.tag
      const name = part("div", "tag", line)
      part("b", "", name, row.tag)
      if (row.similar) part("span", "words", name, row.similar)
      const evidence = part("div", "evidence", line)
      evidence.title = EVIDENCE
      const bar = part("div", "strength", evidence)
      bar.style.width = `${Math.round(100 * row.share)}%`
      part("span", "gain", evidence, row.gain)
      part("span", "gain", evidence, row.unseen)
      part("span", "gain", evidence, row.amplitude.replace(/e-(?=\d)/g, "e\u2011")) // no line ends within a number
      const picture = document.createElementNS(SVG, "svg")
      picture.setAttribute("viewBox", "0 0 114 40")
      picture.setAttribute("class", "signature")
      if (row.picture.length) {
        curve(picture, [[0, row.picture[2][0][1]], [1, row.picture[2][0][1]]], "zero")
        curve(picture, row.picture[0], "residual")
        curve(picture, row.picture[1], "law")
      }
      line.append(picture)
      line.title = row.words
      const button = part("button", row.on ? "off" : "switch", line, row.on ? "Switch off" : "Switch on")
      button.disabled = model.closed
      button.addEventListener("click", (event) => {
        event.stopPropagation()
        model.send_msg({ kind: row.on ? "off" : "on", tag: row.tag, form: row.form })
      })
      part("div", "words whole", line, row.words)
      line.addEventListener("click", () => model.send_msg({ kind: "choose", tag: row.tag, form: row.form }))
    }
  }
  model.on("rows", update)
  model.on("closed", update)
  update()
  return root
}
