// SPDX-License-Identifier: Apache-2.0
/** Named points as a Slicer markups file. */

/** @param {{name: string, at_m: number[], felt?: string, label?: string}[]} marks in the scene's frame @param {string} axes */
export function markupsJson(marks, axes) {
  const controlPoints = marks.map((mark, i) => ({
    id: String(i + 1), label: mark.name, description: mark.felt ?? mark.label ?? '',
    position: mark.at_m.map(v => 1000 * v), positionStatus: 'defined',
  }));
  return JSON.stringify({
    '@schema': 'https://raw.githubusercontent.com/slicer/slicer/master/Modules/Loadable/Markups/' +
               'Resources/Schema/markups-schema-v1.0.3.json#',
    markups: [{type: 'Fiducial', coordinateSystem: axes === 'RAS' ? 'RAS' : 'LPS', coordinateUnits: 'mm', controlPoints}],
  }, null, 2);
}

/** Offers text as a file. */
export function download(name, text) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(new Blob([text], {type: 'application/json'}));
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}
