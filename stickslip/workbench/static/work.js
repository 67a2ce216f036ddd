// What is being done, how far it is, and what came of it.
export function render({ model }) {
  const root = document.createElement("div")
  root.className = "work"
  const update = () => {
    root.replaceChildren()
    const said = document.createElement("span")
    said.className = "said"
    said.textContent = model.doing || model.said
    if (model.doing) {
      const track = document.createElement("div")
      track.className = "track"
      const fill = document.createElement("div")
      fill.className = "fill"
      fill.style.width = `${Math.round(100 * model.share)}%`
      track.append(fill)
      root.append(track)
    }
    root.append(said)
    if (model.doing && model.stopping) {
      const stop = document.createElement("button")
      stop.textContent = "Cancel"
      stop.addEventListener("click", () => model.send_msg({ kind: "cancel" }))
      root.append(stop)
    }
  }
  for (const name of ["doing", "said", "share"]) model.on(name, update)
  update()
  return root
}
