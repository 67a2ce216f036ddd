// Lines to copy.
export function render({ model }) {
  const root = document.createElement("div")
  root.className = "copy"
  const lines = document.createElement("pre")
  const button = document.createElement("button")
  const update = () => { lines.textContent = model.text; button.textContent = "Copy" }
  button.addEventListener("click", async () => {
    try {
      await navigator.clipboard.writeText(model.text)
    } catch {
      const range = document.createRange()
      range.selectNodeContents(lines)
      const chosen = window.getSelection()
      chosen.removeAllRanges()
      chosen.addRange(range)
      document.execCommand("copy")
    }
    button.textContent = "Copied"
  })
  model.on("text", update)
  update()
  root.append(lines, button)
  return root
}
