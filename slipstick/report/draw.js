// The expression interpreter, because the content security policy forbids generated code. The menu has no entry that
// leads to a page on the internet.
const options = {renderer: "svg", ast: true, actions: {export: {svg: true, png: true}, source: false, compiled: false,
                                                       editor: false}};
const specs = JSON.parse(document.getElementById("pictures").textContent);
for (const [name, spec] of Object.entries(specs)) {
  const element = document.getElementById("picture-" + name);
  vegaEmbed(element, spec, {...options, downloadFileName: name}).catch(error => { element.textContent = String(error); });
}
