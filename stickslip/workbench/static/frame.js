// The head of the window. Everything from elsewhere is set as text, never as HTML.
export function render({ model }) {
  const root = document.createElement("div")
  root.className = "frame"
  const top = part("div", "top", root)
  part("span", "name", top, "stickslip")
  const title = part("span", "title", top)
  const shown = part("span", "model", top)
  const errors = part("span", "errors", top)
  errors.title = "in floors of this model: 1 is as good as noise and scatter of the data allow"
  const theme = part("button", "quiet", top)
  const bars = []
  for (const [what, share, stop] of [["busy", "share", "cancel"], ["searching", "searched", "stop"]]) {
    const line = part("div", "bar", root)
    const fill = part("div", "fill", line)
    const text = part("span", "text", line)
    const button = part("button", "stop", line, "Cancel")
    button.addEventListener("click", () => model.send_msg({ kind: stop }))
    bars.push(() => {
      line.style.display = model[what] ? "flex" : "none"
      const done = Math.round(100 * model[share])
      text.textContent = model[what] + (done > 0 ? ` (${done} %)` : "")
      fill.style.width = `${done}%`
      line.classList.toggle("unknown", done <= 0)
    })
  }
  const said = part("div", "said", root)
  const words = part("span", "", said)
  const dismiss = part("button", "quiet", said, "×")
  dismiss.title = "hide"
  dismiss.addEventListener("click", () => model.send_msg({ kind: "dismiss" }))

  const update = () => {
    for (const [line, text] of [[title, model.title], [shown, model.model]]) {
      line.textContent = text
      line.title = text // where it has no room it is cut: a second line would move the sliders from under a hand
    }
    errors.textContent = model.errors
    theme.textContent = model.dark ? "light" : "dark"
    theme.title = "change the theme"
    for (const bar of bars) bar()
    said.style.display = model.said ? "flex" : "none"
    words.textContent = model.said
    said.classList.toggle("well", model.well)
  }
  // by itself: a colour that is set anew has the style of everything found again, which every picture waits for
  const paint = () => {
    const style = document.documentElement.style
    for (const [name, value] of Object.entries(model.colours)) style.setProperty(`--wb-${name}`, value)
    document.body.style.background = model.colours.page || ""
  }
  theme.addEventListener("click", () => {
    const address = new URL(window.location.href)
    address.searchParams.set("theme", model.dark ? "default" : "dark")
    window.location.replace(address)
  })
  if (!new URL(window.location.href).searchParams.has("theme") && matchMedia("(prefers-color-scheme: dark)").matches) {
    theme.click()
  }
  const typed = (event) => {
    const own = (e) => e.isContentEditable || /^(INPUT|TEXTAREA|SELECT|TABLE)$/.test(e.tagName || "")
    if (!model.keyed || event.altKey || event.ctrlKey || event.metaKey || event.composedPath().some(own)) return
    if (["ArrowLeft", "ArrowRight", "ArrowUp", "ArrowDown"].includes(event.key)) {
      event.preventDefault()
      model.send_msg({ kind: "key", key: event.key })
    }
  }
  document.addEventListener("keydown", typed)
  for (const name of ["title", "model", "errors", "busy", "share", "searching", "searched", "said", "well", "dark"]) {
    model.on(name, update)
  }
  model.on("colours", paint)
  model.on("remove", () => document.removeEventListener("keydown", typed))
  update()
  paint()
  return root
}
