// The live view.

export function mount(element, api) {
  const figure = document.createElement("p");
  element.append(figure);
  api.on("state", (state) => {
    figure.textContent = `${state.force.measured_n?.toFixed(2) ?? "–"} N measured, ${state.force.requested_n.toFixed(2)} N wanted`;
  });
}
