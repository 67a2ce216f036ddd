// Sentences under headings. Everything from elsewhere is set as text, never as HTML.
export function render({ model }) {
  const root = document.createElement("div")
  root.className = "list"
  const update = () => {
    root.replaceChildren()
    root.style.maxHeight = model.tall ? `${model.tall}px` : ""
    for (const group of model.groups) {
      const head = document.createElement("div")
      head.className = "head"
      head.textContent = group.head
      root.append(head)
      for (const text of group.items) {
        const item = document.createElement("div")
        item.className = "item " + (group.mark || "")
        item.textContent = text
        root.append(item)
      }
    }
  }
  model.on("groups", update)
  update()
  return root
}
