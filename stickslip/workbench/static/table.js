// A table whose rows can be chosen. Everything from elsewhere is set as text, never as HTML.
const LONG = 40 // signs after which a cell is broken into lines

export function render({ model }) {
  const root = document.createElement("div")
  root.className = "holder"
  const update = () => {
    const table = document.createElement("table")
    const head = table.createTHead().insertRow()
    for (const name of model.columns) {
      const cell = document.createElement("th")
      cell.textContent = name.replace(" / ", "\u00a0/\u00a0").replace("± ", "±\u00a0") // units are not parted
      head.append(cell)
    }
    const body = table.createTBody()
    model.rows.forEach((row, i) => {
      const line = body.insertRow()
      line.dataset.row = i
      if (i === model.chosen) line.className = "chosen"
      row.forEach((text) => {
        const cell = line.insertCell()
        cell.textContent = text
        cell.classList.toggle("long", text.length > LONG)
      })
      if (model.choosing) {
        line.tabIndex = 0
        line.addEventListener("click", () => model.send_msg({ kind: "row", row: i }))
        line.addEventListener("keydown", (e) => { if (e.key === "Enter") line.click() })
      }
    })
    root.classList.toggle("choosing", model.choosing)
    const at = root.scrollTop
    root.replaceChildren(table)
    root.scrollTop = at
    mark()
  }
  const mark = () => {
    root.style.maxHeight = model.tall ? `${model.tall}px` : ""
    for (const line of root.querySelectorAll("tbody tr")) {
      line.className = Number(line.dataset.row) === model.chosen ? "chosen" : ""
    }
    const own = root.querySelector("tr.chosen")
    if (own && (own.offsetTop < root.scrollTop + 24 || own.offsetTop + own.offsetHeight > root.scrollTop + root.clientHeight)) {
      root.scrollTop = own.offsetTop - root.clientHeight / 2
    }
  }
  for (const name of ["rows", "columns", "choosing"]) model.on(name, update)
  model.on("chosen", mark)
  update()
  return root
}
