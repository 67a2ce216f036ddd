// What a figure shows, as CSV: a row for every point, under the texts of its axes. `figure` is given.
const cell = (value) => {
  if (typeof value === "number") return Number.isFinite(value) ? String(value) : ""
  return /[",\n]/.test(value) ? `"${value.replaceAll('"', '""')}"` : value
}
const beside = [...figure.above, ...figure.below, ...figure.left, ...figure.right, ...figure.center]
const names = new Map()
for (const item of beside.flatMap((each) => each.items ?? [])) {
  for (const renderer of item.renderers) names.set(renderer, item.label.value)
}
const axis = (place) => place.map((each) => each.axis_label).find((text) => text) ?? ""

const curves = new Map() // a line and its markers are one
for (const renderer of figure.renderers.filter((each) => each.visible)) {
  const { glyph, data_source: source } = renderer
  // what is drawn otherwise than it is, bent or cut off, has its values in a column of their own
  const column = (field) => [...(source.data[`${field}_value`] ?? source.data[field] ?? [])]
  const pairs = { MultiLine: [["xs", "ys", ""]], VArea: [["x", "y1", " (lower)"], ["x", "y2", " (upper)"]] }
  for (const [x, y, end] of pairs[glyph.type] ?? [["x", "y", ""]]) {
    const [across, up] = [glyph[x].field, glyph[y].field]
    const name = renderer.name ?? names.get(renderer)
    const key = `${source.id} ${across} ${up}`
    const known = curves.get(key)
    if (known) known.name = name ?? known.name
    else {
      const [xs, ys] = [column(across), column(up)]
      if (glyph.type !== "MultiLine") curves.set(key, { name, else: up, end, xs, ys })
      else xs.forEach((part, i) => {
        curves.set(`${key} ${i}`, { name, else: up, end: ` ${i + 1}`, xs: [...part], ys: [...ys[i]] })
      })
    }
  }
}
const up = axis(figure.left)
const lines = [["curve", figure.tags[0] ?? axis(figure.below), up]]
for (const each of curves.values()) {
  each.xs.forEach((x, i) => lines.push([(each.name ?? each.else) + each.end, x, each.ys[i]]))
}
const text = "\ufeff" + lines.map((line) => line.map(cell).join(",")).join("\n") + "\n" // the mark: for spreadsheets
const link = document.createElement("a")
link.href = URL.createObjectURL(new Blob([text], { type: "text/csv" }))
link.download = `${(up.split(" / ")[0] || "curves").replace(/[^\p{L}\p{N}]+/gu, "-")}.csv`
link.click()
setTimeout(() => URL.revokeObjectURL(link.href), 1000)
