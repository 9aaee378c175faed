"use strict";
// Without scripts everything can be read: pictures then open as files, and the filter works by the style sheet alone.
const dialog = document.getElementById("large"), picture = dialog.querySelector("img");
for (const link of document.querySelectorAll("a.enlarge")) {
  link.addEventListener("click", (event) => {
    event.preventDefault();
    picture.src = link.firstElementChild.src;
    picture.alt = link.firstElementChild.alt;
    // At its own size, but on a small screen of many points no wider than twice the screen, or than it is sharp.
    const natural = link.firstElementChild.naturalWidth;
    picture.style.width = `${Math.min(natural, Math.max(natural / devicePixelRatio, 2 * innerWidth))}px`;
    dialog.showModal();
  });
}
// A click beside the picture closes it, too.
dialog.addEventListener("click", (event) => { if (event.target === dialog) dialog.close(); });
dialog.addEventListener("close", () => picture.removeAttribute("src"));

const claims = [...document.querySelectorAll(".claim")], shown = document.getElementById("shown");
function count() {
  const visible = claims.filter((claim) => getComputedStyle(claim).display !== "none").length;
  shown.textContent = `${visible} of ${claims.length} shown`;
}
document.querySelector(".filter").addEventListener("change", count);
count();

// On paper everything is open, and afterwards what was open before.
const folded = [...document.querySelectorAll("details")];
let open = [];
addEventListener("beforeprint", () => {
  open = folded.map((one) => one.open);
  for (const one of folded) one.open = true;
});
addEventListener("afterprint", () => folded.forEach((one, i) => { one.open = open[i]; }));

const contents = document.querySelector(".contents");
contents.addEventListener("click", (event) => { if (event.target.closest("a")) contents.open = false; });
