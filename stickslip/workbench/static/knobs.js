// Sliders. A hand sends at most ten places a second, the last one always, from the first touch on.
const EVERY = 100 // ms

// A text that is set anew has the whole page laid out again, which every picture then waits for.
function put(element, key, value) {
  if (element[key] !== value) element[key] = value
}

export function render({ model }) {
  const root = document.createElement("div")
  root.className = "knobs"
  let known = new Map()
  let held = ""

  function knob(row) {
    const box = part("div", "knob", root)
    box.dataset.name = row.name
    const head = part("div", "head", box)
    const label = part("span", "label", head)
    const value = part("span", "value", head)
    const way = part("div", "way", box)
    const band = part("div", "band", part("div", "rail", way))
    band.title = "one standard deviation to either side of the value"
    const slider = part("input", "slider", way)
    slider.type = "range"
    slider.min = 0
    slider.max = 1
    slider.step = 0.001
    const foot = part("div", "foot", box)
    const low = part("span", "", foot)
    const prior = part("span", "prior", foot)
    const high = part("span", "", foot)
    const lock = part("label", "lock", head)
    const tick = part("input", "", lock)
    tick.type = "checkbox"
    part("span", "", lock, "lock")

    let sent = 0
    let waiting = null
    let first = true
    const send = () => {
      waiting = null
      sent = performance.now()
      model.send_msg({ kind: "move", name: row.name, place: Number(slider.value), first })
      first = false
    }
    slider.addEventListener("input", () => {
      held = row.name
      if (waiting !== null) return
      const left = EVERY - (performance.now() - sent)
      if (left <= 0) send()
      else waiting = setTimeout(send, left)
    })
    const release = () => {
      if (waiting !== null) {
        clearTimeout(waiting)
        send()
      }
      first = true
      held = ""
    }
    slider.addEventListener("change", release)
    tick.addEventListener("change", () => model.send_msg({ kind: "lock", name: row.name, on: tick.checked }))
    return (now) => {
      put(label, "textContent", now.label)
      put(label, "title", now.doc)
      put(value, "textContent", now.text)
      put(prior, "textContent", now.prior)
      put(prior, "title", now.prior)
      put(low, "textContent", now.low)
      put(high, "textContent", now.high)
      put(slider, "ariaLabel", now.label)
      put(slider, "disabled", model.closed || now.locked)
      put(tick, "checked", now.locked)
      box.classList.toggle("effect", now.group !== "")
      if (held !== row.name) put(slider, "value", String(now.place))
      put(band.style, "display", now.band[1] > now.band[0] ? "" : "none")
      put(band.style, "left", `${50 * (now.band[0] + now.band[1])}%`)
      put(band.style, "width", `${100 * (now.band[1] - now.band[0])}%`)
    }
  }

  const update = () => {
    const names = model.rows.map((r) => r.name)
    if (names.join() !== [...known.keys()].join()) {
      root.replaceChildren()
      known = new Map()
      let group = null
      for (const row of model.rows) {
        if (row.group !== group) part("div", "group", root, row.group || "base model")
        group = row.group
        known.set(row.name, knob(row))
      }
      if (model.given.length) part("div", "group", root, "stated by the campaign's file")
      for (const row of model.given) {
        const line = part("div", "given", root)
        line.title = row.doc
        part("span", "label", line, row.label)
        part("span", "value", line, row.text)
      }
    }
    for (const row of model.rows) known.get(row.name)(row)
  }
  model.on("rows", update)
  model.on("given", () => {
    known = new Map()
    update()
  })
  model.on("closed", update)
  update()
  return root
}
