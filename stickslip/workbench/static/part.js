// An element within another one. Its text is set as text, never as HTML.
function part(kind, classes, parent, text) {
  const made = document.createElement(kind)
  made.className = classes
  if (text) made.textContent = text
  parent.append(made)
  return made
}
