// SPDX-License-Identifier: Apache-2.0
/** Elements of the page. */

/** The element with this id. */
export const at = id => document.getElementById(id);

/** An element with text and attributes. */
export function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}
