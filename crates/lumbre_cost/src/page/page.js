// The slider between a picture and what it is compared with. Without scripts the first picture of each study stands beside its reference.
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
