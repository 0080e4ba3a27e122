"use strict";
// Columns are sorted by a click on their heads; names by the numbers in them, too.
for (const table of document.querySelectorAll("table")) {
  const body = table.tBodies[0];
  if (body.rows.length < 2) continue;
  const text = (row, column) => row.cells[column].textContent;
  // Bounds such as "< 1e-99", decimal commas, and degrees, minutes and seconds are numbers, too.
  const number = (row, column) => {
    const string = text(row, column).replace(/^< /, "").replace(",", ".");
    const [degrees, minutes = 0, seconds = 0] = string.split(" ").map(parseFloat);
    return (Math.abs(degrees) + minutes / 60 + seconds / 3600) * (string.startsWith("-") ? -1 : 1);
  };
  [...table.tHead.rows[0].cells].forEach((head, column) => {
    const button = document.createElement("button");
    button.append(...head.childNodes);
    head.append(button);
    button.addEventListener("click", () => {
      const words = head.classList.contains("text");
      const before = head.getAttribute("aria-sort");
      const up = before ? before === "descending" : words;
      for (const other of table.tHead.rows[0].cells) other.removeAttribute("aria-sort");
      head.setAttribute("aria-sort", up ? "ascending" : "descending");
      const rows = [...body.rows];
      const known = (row) => words || !Number.isNaN(number(row, column));
      rows.sort((a, b) => {
        if (!known(a) || !known(b)) return known(b) - known(a);
        const order = words
          ? text(a, column).localeCompare(text(b, column), document.documentElement.lang, { numeric: true })
          : number(a, column) - number(b, column);
        return up ? order : -order;
      });
      body.append(...rows);
    });
  });
}
// Of layers one is shown; on paper, and without this script, all are.
for (const group of document.querySelectorAll(".layers")) {
  const layers = [...group.children];
  if (layers.length < 2) continue;
  const bar = document.createElement("div");
  bar.className = "switch";
  bar.setAttribute("role", "tablist");
  const show = (chosen) => layers.forEach((layer, k) => {
    layer.hidden = layer !== chosen;
    bar.children[k].setAttribute("aria-selected", String(layer === chosen));
  });
  for (const layer of layers) {
    const button = document.createElement("button");
    button.setAttribute("role", "tab");
    button.textContent = layer.dataset.title;
    button.addEventListener("click", () => show(layer));
    bar.append(button);
  }
  group.classList.add("switched");
  group.prepend(bar);
  show(layers[0]);
}
// A link into a layer that is not shown brings it forward.
const reveal = () => {
  const target = location.hash && document.getElementById(decodeURIComponent(location.hash.slice(1)));
  const layer = target && target.closest(".layer[hidden]");
  if (!layer) return;
  const bar = layer.parentElement.querySelector(".switch");
  bar.children[[...layer.parentElement.querySelectorAll(".layer")].indexOf(layer)].click();
  target.scrollIntoView();
};
window.addEventListener("hashchange", reveal);
reveal();
