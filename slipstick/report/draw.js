// The interpreter instead of generated code, and no menu entry that leads to a page on the internet.
const options = {renderer: "svg", ast: true, actions: {export: {svg: true, png: true}, source: false, compiled: false,
                                                       editor: false}};
const specs = JSON.parse(document.getElementById("pictures").textContent);
for (const [name, spec] of Object.entries(specs)) {
  const place = document.getElementById("picture-" + name);
  vegaEmbed(place, spec, {...options, downloadFileName: name}).catch(error => { place.textContent = String(error); });
}
