#!/usr/bin/env python3
# SPDX-License-Identifier: Apache-2.0
"""How much stiffer a lump makes the tissue over it: finite elements against the kernel.

Makes the table of docs/palpation.md, "How well the map foretells a lump":

    scripts/fe_lump.py                       # all 24 cases: some minutes
    scripts/fe_lump.py --cell 0.5            # coarser, some 20 s
    scripts/fe_lump.py --case 5 5 10 20      # one lump: top, radius (mm), ratio, thickness (mm)
    scripts/fe_lump.py --beside 0 3 6 9 12   # a lump of 5 mm, 5 mm deep, so many mm beside the punch

Needs python3-numpy and python3-scipy of Debian, and nothing of Palpate's.

The tissue is a round slab, bonded to a stiff base, of modulus E and Poisson's ratio 0.49. A flat
round punch of radius a presses it without friction, on the axis. The lump is a sphere on the axis,
of modulus ratio times E. Elements are axisymmetric, with eight nodes and 2 x 2 Gauss points, which
nearly incompressible tissue does not lock. Stiffness is the punch's force over its way, small
strain.

Beside the axis the same elements carry a Fourier series along the circle: the slab alone couples no
two terms of it, the lump couples them all. Conjugate gradients solve that, with the slab alone as
preconditioner. The punch does not tilt.
"""
import argparse
import math
import sys
import time

try:
    import numpy as np
    from scipy.sparse import coo_matrix
    from scipy.sparse.linalg import splu
except ImportError as error:
    sys.exit(f"fe_lump.py: {error}; apt-get install python3-numpy python3-scipy")

POISSON = 0.49
PUNCH_MM = 4.0
SLAB_MM = 100.0  # radius of the slab: 25 punches, so that its rim is not felt
KPA = 1e-3  # N/mm^2

# Top of the lump under the surface and its radius in mm, and the ratio of moduli.
LUMPS = [
    (2.0, 2.5, 10.0), (2.0, 5.0, 2.0), (2.0, 5.0, 10.0), (3.0, 3.0, 10.0),
    (5.0, 2.5, 10.0), (5.0, 5.0, 2.0), (5.0, 5.0, 4.0), (5.0, 5.0, 10.0),
    (5.0, 5.0, 100.0), (5.0, 7.5, 10.0), (8.0, 4.0, 10.0), (10.0, 5.0, 10.0)]
THICKNESSES_MM = (20.0, 40.0)


def grown(start, end, first, ratio=1.15, largest=4.0):
    """Borders from start to end in cells that begin with `first` and grow."""
    sizes, left = [], end - start
    size = first
    while sum(sizes) < left:
        sizes.append(size)
        size = min(size * ratio, largest)
    sizes = np.array(sizes) * (left / sum(sizes))
    return start + np.cumsum(sizes)


def borders_of(fine_to, end, cell):
    fine = np.arange(0.0, fine_to + 0.5 * cell, cell)
    return fine if end <= fine_to else np.concatenate([fine, grown(fine_to, end, cell)])


def shapes(x, y):
    """Shape functions of the eight-node element at (x, y) in [-1, 1]^2, and their derivatives."""
    corners = [(-1, -1), (1, -1), (1, 1), (-1, 1)]
    n, dx, dy = np.zeros(8), np.zeros(8), np.zeros(8)
    for i, (a, b) in enumerate(corners):
        n[i] = 0.25 * (1 + a * x) * (1 + b * y) * (a * x + b * y - 1)
        dx[i] = 0.25 * a * (1 + b * y) * (2 * a * x + b * y)
        dy[i] = 0.25 * b * (1 + a * x) * (a * x + 2 * b * y)
    for i, (a, b) in enumerate([(0, -1), (1, 0), (0, 1), (-1, 0)], start=4):
        if a == 0:
            n[i], dx[i], dy[i] = 0.5 * (1 - x * x) * (1 + b * y), -x * (1 + b * y), 0.5 * b * (1 - x * x)
        else:
            n[i], dx[i], dy[i] = 0.5 * (1 + a * x) * (1 - y * y), 0.5 * a * (1 - y * y), -y * (1 + a * x)
    return n, dx, dy


class Slab:
    """A slab of one thickness, its elements made once; each lump is solved on them."""

    def __init__(self, thickness_mm, cell_mm, fine_to_mm=12.0):
        r = borders_of(fine_to_mm, SLAB_MM, cell_mm)
        z = borders_of(min(thickness_mm, 20.0), thickness_mm, cell_mm)  # depth
        nr, nz = len(r) - 1, len(z) - 1
        # Nodes on a grid of half cells; the middles of cells are none.
        half = lambda v: np.sort(np.concatenate([v, 0.5 * (v[1:] + v[:-1])]))
        rr, zz = np.meshgrid(half(r), half(z), indexing="ij")
        is_node = np.ones(rr.shape, bool)
        is_node[1::2, 1::2] = False
        number = np.full(rr.shape, -1)
        number[is_node] = np.arange(is_node.sum())
        self.r, self.z = rr[is_node], zz[is_node]
        i, j = (v.ravel() for v in np.meshgrid(2 * np.arange(nr), 2 * np.arange(nz), indexing="ij"))
        at = [(0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1)]
        self.nodes = np.stack([number[i + a, j + b] for a, b in at], axis=1)
        self._make_elements()
        self.thickness_mm = thickness_mm

    def _make_elements(self):
        self.dofs = np.stack([2 * self.nodes, 2 * self.nodes + 1], axis=2).reshape(len(self.nodes), 16)
        re, ze = self.r[self.nodes], self.z[self.nodes]
        lam = POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        mu = 0.5 / (1 + POISSON)
        law = np.full((4, 4), 0.0)
        law[:3, :3] = lam
        law += np.diag([2 * mu, 2 * mu, 2 * mu, mu])  # of modulus 1
        self.points = []  # of each Gauss point: place, stiffness of modulus 1
        self.shapes = []  # and: shape functions, their derivatives by r and z, radius, depth, area
        g = 1 / math.sqrt(3)
        for x, y in [(-g, -g), (g, -g), (g, g), (-g, g)]:
            n, dx, dy = shapes(x, y)
            jac = np.array([[re @ dx, ze @ dx], [re @ dy, ze @ dy]])  # (2, 2, elements)
            det = jac[0, 0] * jac[1, 1] - jac[0, 1] * jac[1, 0]
            dr = (jac[1, 1][:, None] * dx - jac[0, 1][:, None] * dy) / det[:, None]
            dz = (-jac[1, 0][:, None] * dx + jac[0, 0][:, None] * dy) / det[:, None]
            radius = re @ n
            strain = np.zeros((len(re), 4, 16))  # rr, zz, hoop, shear
            strain[:, 0, 0::2] = dr
            strain[:, 1, 1::2] = dz
            strain[:, 2, 0::2] = n / radius[:, None]
            strain[:, 3, 0::2] = dz
            strain[:, 3, 1::2] = dr
            volume = 2 * math.pi * radius * det
            stiffness = np.einsum("eki,kl,elj,e->eij", strain, law, strain, volume, optimize=True)
            self.points.append((radius, ze @ n, stiffness))
            self.shapes.append((n, dr, dz, radius, ze @ n, det))

    def solve(self, modulus):
        """Force per way of the punch, N/mm, and twice the energy at each Gauss point."""
        total = sum(modulus(r, z)[:, None, None] * k for r, z, k in self.points)
        rows = np.repeat(self.dofs, 16, axis=1).ravel()
        columns = np.tile(self.dofs, (1, 16)).ravel()
        size = 2 * len(self.r)
        matrix = coo_matrix((total.ravel(), (rows, columns)), shape=(size, size)).tocsc()
        near = 1e-9
        base = self.z > self.thickness_mm - near
        under_punch = (self.z < near) & (self.r < PUNCH_MM + near)
        known = np.zeros(size, bool)
        known[0::2] = base | (self.r < near)
        known[1::2] = base | under_punch
        way = np.zeros(size)
        way[1::2][under_punch] = 1.0  # mm, into the tissue
        free = np.flatnonzero(~known)
        load = -(matrix[free] @ way)
        way[free] = splu(matrix[free][:, free], permc_spec="MMD_AT_PLUS_A",
                         options={"SymmetricMode": True}, diag_pivot_thresh=0.0).solve(load)
        local = way[self.dofs]
        energies = [modulus(r, z) * np.einsum("ei,eij,ej->e", local, k, local) for r, z, k in self.points]
        return float(way @ (matrix @ way)), energies


class Series:
    """The same slab under displacements that are no rings: with t the angle about the punch's axis,
    from the plane through the lump's middle,

        u_r = sum a_n cos(n t)    u_t = sum c_n sin(n t)    u_z = sum b_n cos(n t)

    The unknowns of a node are (a, c, b), for each n < TERMS."""

    TERMS, ANGLES = 24, 96  # angles in half a circle: the lump's outline is sampled there

    def __init__(self, slab):
        self.slab = slab
        lam = POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
        mu = 0.5 / (1 + POISSON)
        self.law = np.diag([2 * mu, 2 * mu, 2 * mu, mu, mu, mu])  # rr, zz, hoop, rz, rt, zt
        self.law[:3, :3] += lam
        self.dofs = (3 * slab.nodes[:, :, None] + np.arange(3)).reshape(len(slab.nodes), 24)
        angle = (np.arange(self.ANGLES) + 0.5) * math.pi / self.ANGLES
        self.angle = angle
        # Of the four strains that go with cos(n t), and the two that go with sin(n t).
        self.along = [np.stack([np.cos(n * angle)] * 4 + [np.sin(n * angle)] * 2) for n in range(self.TERMS)]
        self.matrices, self.spaces, self.factors = [], [], []
        for n in range(self.TERMS):
            self._add_term(n)
        size = 3 * len(slab.r)
        self.way = np.zeros((self.TERMS, size))  # the punch's: 1 mm into the tissue
        under_punch = (slab.z < 1e-9) & (slab.r < PUNCH_MM + 1e-9)
        self.way[0, 2::3][under_punch] = 1.0
        self.plain = self.way + self._solve(-self._apply_slab(self.way))
        self.stiffness = float(np.sum(self.plain * self._apply_slab(self.plain)))

    def strains(self, n, point, elements=slice(None)):
        """(elements, 6, 24): strains at a Gauss point by the unknowns of term n."""
        shape, dr, dz, radius, _, _ = self.slab.shapes[point]
        dr, dz, over_r = dr[elements], dz[elements], shape / radius[elements][:, None]
        b = np.zeros((len(dr), 6, 8, 3))
        b[:, 0, :, 0] = dr
        b[:, 1, :, 2] = dz
        b[:, 2, :, 0], b[:, 2, :, 1] = over_r, n * over_r
        b[:, 3, :, 0], b[:, 3, :, 2] = dz, dr
        b[:, 4, :, 0], b[:, 4, :, 1] = -n * over_r, dr - over_r
        b[:, 5, :, 1], b[:, 5, :, 2] = dz, -n * over_r
        return b.reshape(len(dr), 6, 24)

    def _add_term(self, n):
        circle = 2 * math.pi if n == 0 else math.pi  # integral of cos^2 or sin^2 over a turn
        total = 0.0
        for point, (_, _, _, radius, _, det) in enumerate(self.slab.shapes):
            b = self.strains(n, point)
            total = total + np.einsum("eki,kl,elj,e->eij", b, self.law, b, circle * radius * det, optimize=True)
        rows, columns = np.repeat(self.dofs, 24, axis=1).ravel(), np.tile(self.dofs, (1, 24)).ravel()
        size = 3 * len(self.slab.r)
        matrix = coo_matrix((total.ravel(), (rows, columns)), shape=(size, size)).tocsc()
        space = self._free(n)
        self.matrices.append(matrix)
        self.spaces.append(space)
        self.factors.append(splu((space.T @ matrix @ space).tocsc(), permc_spec="MMD_AT_PLUS_A",
                                 options={"SymmetricMode": True}, diag_pivot_thresh=0.0))

    def _free(self, n):
        """Unknowns by those that are free: all but those of the base, of u_z under the punch, and of
        what the axis allows. There u_z may be of n = 0, and a way aside is u_r = a cos t, u_t = -a sin t."""
        slab = self.slab
        free = np.repeat(slab.z < slab.thickness_mm - 1e-9, 3)
        free[2::3] &= ~((slab.z < 1e-9) & (slab.r < PUNCH_MM + 1e-9))
        axis = slab.r < 1e-9
        free[0::3] &= ~axis if n != 1 else True
        free[1::3] &= ~axis if n != 0 else False  # sin(0 t)
        free[2::3] &= ~axis if n != 0 else True
        number = np.cumsum(free) - 1
        rows = np.flatnonzero(free)
        columns, values = number[rows], np.ones(len(rows))
        if n == 1:
            ends = np.flatnonzero(axis & free[0::3])
            rows = np.concatenate([rows, 3 * ends + 1])
            columns = np.concatenate([columns, number[3 * ends]])
            values = np.concatenate([values, -np.ones(len(ends))])
        return coo_matrix((values, (rows, columns)), shape=(len(free), int(free.sum()))).tocsc()

    def _apply_slab(self, u):
        return np.stack([matrix @ part for matrix, part in zip(self.matrices, u)])

    def _solve(self, load):
        return np.stack([space @ factor.solve(space.T @ part)
                         for space, factor, part in zip(self.spaces, self.factors, load)])

    def with_lump(self, top, radius, ratio, beside):
        """K/K0 with a sphere whose middle is `beside` mm from the punch's axis."""
        regions = []
        for point, (_, _, _, r, z, det) in enumerate(self.slab.shapes):
            x, y = r[:, None] * np.cos(self.angle) - beside, r[:, None] * np.sin(self.angle)
            inside = x * x + y * y + (z[:, None] - top - radius) ** 2 < radius * radius
            elements = np.flatnonzero(inside.any(axis=1))
            if not len(elements):
                continue
            weight = 2 * math.pi / self.ANGLES * (ratio - 1) * (r * det)[elements, None] * inside[elements]
            regions.append((self.dofs[elements], weight,
                            [self.strains(n, point, elements) for n in range(self.TERMS)]))

        def apply(u):
            out = self._apply_slab(u)
            for dofs, weight, terms in regions:
                strain = sum(np.einsum("eki,ei->ek", b, part[dofs])[:, :, None] * along
                             for b, part, along in zip(terms, u, self.along))
                stress = np.einsum("kl,elt,et->ekt", self.law, strain, weight, optimize=True)
                for b, part, along in zip(terms, out, self.along):
                    np.add.at(part, dofs, np.einsum("eki,ekt,kt->ei", b, stress, along, optimize=True))
            return out

        u = self.plain.copy()
        rest = -apply(u)
        step = better = self._solve(rest)
        size = begin = np.sum(rest * better)
        while size > 1e-10 * begin:  # of the energy that is left: far below what the cells err by
            bent = apply(step)
            length = size / np.sum(step * bent)
            u, rest = u + length * step, rest - length * bent
            better = self._solve(rest)
            size, before = np.sum(rest * better), size
            step = better + size / before * step
        return float(np.sum(u * apply(u))) / self.stiffness


def kernel_beside(top, radius, beside, a=PUNCH_MM, cells=80):
    """Integral of the kernel w over a sphere beside the axis, by cells."""
    at = radius * (2 * (np.arange(cells) + 0.5) / cells - 1)
    x, y, z = np.meshgrid(at, at, at, indexing="ij")
    inside = x * x + y * y + z * z < radius * radius
    x, y, z = x[inside] + beside, y[inside], z[inside] + top + radius
    w = 6 * a / math.pi**2 * z * z / (x * x + y * y + z * z + (0.75 * a) ** 2) ** 3
    return float(w.sum()) * (2 * radius / cells) ** 3


def print_beside(wanted, besides, cell):
    print("| top mm | radius mm | ratio | slab mm | beside mm | elements K/K0 | kernel K/K0 |"
          " kernel against elements |")
    print("|---|---|---|---|---|---|---|---|")
    for thick in sorted({w[3] for w in wanted}):
        series = Series(Slab(thick, cell, fine_to_mm=18.0))
        for top, radius, ratio, _ in [w for w in wanted if w[3] == thick]:
            for beside in besides:
                elements = series.with_lump(top, radius, ratio, beside)
                closed = 1 + factor(ratio) * kernel_beside(top, radius, beside)
                print(f"| {top:g} | {radius:g} | {ratio:g} | {thick:g} | {beside:g} | {elements:.3f} |"
                      f" {closed:.3f} | {100 * (closed / elements - 1):+.1f} % |", flush=True)


def factor(ratio):
    """C(m): by how much a dilute sphere of modulus ratio m counts."""
    return 5 * (ratio - 1) / (2 * ratio + 3)


def kernel_share(top, radius, a=PUNCH_MM, cells=400):
    """Integral of the kernel w over a sphere on the axis."""
    z = top + radius + radius * (2 * (np.arange(cells) + 0.5) / cells - 1)
    rim2 = radius**2 - (z - top - radius) ** 2
    c2 = (0.75 * a) ** 2
    # Over a disc: 2 pi r / (r^2 + s)^3 integrates to pi/2 (s^-2 - (rim2 + s)^-2).
    s = z * z + c2
    disc = 0.5 * math.pi * (s**-2 - (rim2 + s) ** -2)
    return float(6 * a / math.pi**2 * np.sum(z * z * disc) * 2 * radius / cells)


def case(slab, plain, energies, lump, youngs):
    top, radius, ratio = lump
    inside = lambda r, z: r * r + (z - top - radius) ** 2 < radius * radius
    stiffness, _ = slab.solve(lambda r, z: youngs * np.where(inside(r, z), ratio, 1.0))
    share = sum(e[inside(r, z)].sum() for (r, z, _), e in zip(slab.points, energies)) / plain
    closed = 1 + factor(ratio) * kernel_share(top, radius)
    return stiffness / plain, closed, 1 + factor(ratio) * share


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--cell", type=float,
                        help="mm, near the punch; divides 4 (default 0.25; 0.5 with --beside)")
    parser.add_argument("--beside", type=float, nargs="+", metavar="MM",
                        help="the lump so far beside the punch; without --case: 5 5 10 20 and 5 5 10 40")
    parser.add_argument("--youngs", type=float, default=10.0, help="kPa (default 10)")
    parser.add_argument("--case", type=float, nargs=4, action="append",
                        metavar=("TOP", "RADIUS", "RATIO", "THICKNESS"), help="one lump; may be repeated")
    options = parser.parse_args()
    options.cell = options.cell or (0.5 if options.beside else 0.25)
    if options.beside and not all(0 <= beside <= 12 for beside in options.beside):
        sys.exit("fe_lump.py: --beside: take 0 to 12 mm; the elements are fine as far as 18")
    if abs(PUNCH_MM / options.cell - round(PUNCH_MM / options.cell)) > 1e-9:
        sys.exit(f"fe_lump.py: --cell {options.cell}: the punch's radius of 4 mm is no multiple of it; take 0.25")
    if options.case and any(top <= 0 or radius <= 0 or ratio <= 0 or top + 2 * radius > min(thick, 20)
                            for top, radius, ratio, thick in options.case):
        sys.exit("fe_lump.py: --case: the lump is to lie in the upper 20 mm of the slab, all above 0")
    for *_, thick in options.case or []:
        if thick <= 20 and abs(thick / options.cell - round(thick / options.cell)) > 1e-9:
            sys.exit(f"fe_lump.py: --case: a slab of {thick:g} mm is no multiple of cells of {options.cell:g} mm; "
                     "take another thickness, or --cell")
    began = time.monotonic()
    if options.beside:
        print_beside(options.case or [(5.0, 5.0, 10.0, thick) for thick in THICKNESSES_MM], options.beside,
                     options.cell)
        print(f"\nCells of {options.cell:g} mm; {time.monotonic() - began:.0f} s.")
        return
    youngs = options.youngs * KPA
    wanted = options.case or [(*lump, thick) for thick in THICKNESSES_MM for lump in LUMPS]
    print("| top mm | radius mm | ratio | slab mm | elements K/K0 | kernel K/K0 | kernel against elements |"
          " of what the lump adds | elements' own energy share |")
    print("|---|---|---|---|---|---|---|---|---|")
    differences, contrasts = [], []
    levels = []
    for thick in sorted({w[3] for w in wanted}):
        slab = Slab(thick, options.cell)
        plain, energies = slab.solve(lambda r, z: np.full(r.shape, youngs))
        levels.append((thick, plain))
        for top, radius, ratio, _ in [w for w in wanted if w[3] == thick]:
            elements, closed, share = case(slab, plain, energies, (top, radius, ratio), youngs)
            differences.append(100 * (closed / elements - 1))
            contrasts.append(100 * ((closed - 1) / (elements - 1) - 1))
            print(f"| {top:g} | {radius:g} | {ratio:g} | {thick:g} | {elements:.3f} | {closed:.3f} |"
                  f" {differences[-1]:+.1f} % | {contrasts[-1]:+.0f} % | {share:.3f} |", flush=True)
    half_space = 2 * PUNCH_MM * youngs / (1 - POISSON**2)
    print()
    for thick, plain in levels:
        print(f"Without a lump, {thick:g} mm: {plain:.4f} N/mm; deep tissue, 2 a E / (1 - nu^2): {half_space:.4f}.")
    print(f"{len(differences)} cases, cells of {options.cell:g} mm: K {min(differences):+.1f} to "
          f"{max(differences):+.1f} %, what the lump adds {min(contrasts):+.0f} to {max(contrasts):+.0f} %; "
          f"{time.monotonic() - began:.0f} s.")


if __name__ == "__main__":
    main()
