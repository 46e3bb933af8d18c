// The slider between a picture and what it is compared with. Without scripts, the first picture of each study is shown with its reference.
for (const viewer of document.querySelectorAll(".viewer")) {
  const pair = viewer.querySelector(".pair");
  const [picture, other] = pair.querySelectorAll("img");
  const caption = viewer.querySelector("figure > figcaption");
  const slider = viewer.querySelector("input[type=range]");
  const choices = [...viewer.querySelectorAll("input[type=radio]")];
  const buttons = [...viewer.querySelectorAll("button")];
  const show = () => {
    const chosen = buttons.find((button) => button.getAttribute("aria-pressed") === "true");
    const references = [...viewer.querySelectorAll("img[data-name]")];
    const reference = references.find((image) => image.dataset.name === chosen.dataset.reference);
    const heat = choices.find((choice) => choice.checked).value === "heat";
    const title = chosen.querySelector("span").textContent;
    picture.src = chosen.querySelector("img").src;
    picture.alt = `The picture of ${title}`;
    other.src = heat ? chosen.dataset.heat : reference.src;
    caption.textContent = `${title}: ${chosen.dataset.cost}`;
  };
  for (const button of buttons) {
    button.addEventListener("click", () => {
      buttons.forEach((each) => each.setAttribute("aria-pressed", String(each === button)));
      show();
    });
  }
  choices.forEach((choice) => choice.addEventListener("change", show));
  slider.addEventListener("input", () => pair.style.setProperty("--at", `${slider.value}%`));
}

// Points of plots show their details when they are pointed at, tapped or focused, and their picture in the viewer when they are chosen.
for (const figure of document.querySelectorAll(".plot")) {
  const tip = figure.querySelector(".tip");
  const [image] = tip.getElementsByTagName("img"), [text] = tip.getElementsByTagName("p");
  const section = figure.closest("section");
  const buttonOf = (hit) => section.querySelector(`.gallery button[data-point="${hit.dataset.point}"]`);
  const show = (hit) => {
    const picture = buttonOf(hit)?.querySelector("img");
    image.hidden = !picture;
    if (picture) image.src = picture.src;
    text.textContent = hit.dataset.details;
    tip.hidden = false;
    // Place the details beside the point, within the figure.
    const frame = figure.getBoundingClientRect(), mark = hit.getBoundingClientRect();
    const left = mark.right - frame.left + 4, room = frame.width - tip.offsetWidth;
    const beside = left <= room ? left : mark.left - frame.left - tip.offsetWidth - 4;
    tip.style.left = `${Math.max(0, Math.min(beside, room))}px`;
    tip.style.top = `${Math.max(0, mark.top - frame.top)}px`;
  };
  const hide = () => { tip.hidden = true; };
  for (const hit of figure.querySelectorAll(".hit")) {
    hit.addEventListener("pointerenter", () => show(hit));
    hit.addEventListener("focus", () => show(hit));
    hit.addEventListener("pointerleave", (event) => { if (event.pointerType === "mouse") hide(); });
    hit.addEventListener("blur", hide);
    hit.addEventListener("click", () => { show(hit); buttonOf(hit)?.click(); });
    hit.addEventListener("keydown", (event) => { if (event.key === "Enter") buttonOf(hit)?.click(); });
  }
}
