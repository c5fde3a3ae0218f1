(() => {
  for (const table of document.querySelectorAll("table.sortable")) {
    const body = table.tBodies[0];
    const heads = Array.from(table.tHead.rows[0].cells);
    const key = (row, k) => {
      const text = row.cells[k].textContent.trim().replace("\u2212", "-");
      return text === "" ? null : isNaN(Number(text)) ? text : Number(text);
    };
    heads.forEach((head, k) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = head.textContent;
      head.textContent = "";
      head.appendChild(button);
      button.addEventListener("click", () => {
        const up = head.getAttribute("aria-sort") !== "ascending";
        heads.forEach((other) => other.removeAttribute("aria-sort"));
        head.setAttribute("aria-sort", up ? "ascending" : "descending");
        const rows = Array.from(body.rows);
        rows.sort((a, b) => {
          const [x, y] = [key(a, k), key(b, k)];
          if (x === null || y === null) return (x === null) - (y === null);
          if (typeof x === "number" && typeof y === "number") return up ? x - y : y - x;
          return (up ? 1 : -1) * String(x).localeCompare(String(y));
        });
        rows.forEach((row) => body.appendChild(row));
      });
    });
  }
  for (const box of document.querySelectorAll("input[data-toggle]")) {
    box.addEventListener("change", () => {
      for (const series of document.querySelectorAll(`g[data-series="${box.dataset.toggle}"]`)) {
        series.style.display = box.checked ? "" : "none";
      }
    });
  }
  for (const box of document.querySelectorAll("input[data-by]")) {
    box.addEventListener("change", () => document.body.classList.toggle(box.dataset.by, box.checked));
  }
  for (const toggles of document.querySelectorAll("fieldset.toggles")) toggles.hidden = false;
  const show = () => {
    // a link to a frame of which the card is filtered away, or which is in a closed table, shows it
    const target = location.hash && document.getElementById(location.hash.slice(1));
    if (!target) return;
    for (let at = target; at; at = at.parentElement) {
      if (at.tagName === "DETAILS") at.open = true;
      if (at.hidden) at.hidden = false;
    }
    target.scrollIntoView();
  };
  window.addEventListener("hashchange", show);
  show();
})();
