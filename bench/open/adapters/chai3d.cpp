// SPDX-License-Identifier: Apache-2.0
// CHAI3D's finger proxy as an entry to the open benchmark:   open_chai3d TRACK ANSWER.csv
// Compiled where CHAI3D's sources are: cmake -S bench/open -B build/open -DCHAI3D_DIR=FOLDER
#include <algorithm>

#include "../entry.h"
#include "chai3d.h"

namespace {

// In mm: the proxy stays 1e-4 units of length in front of what it meets.
constexpr double kPerMetre = 1000.0;

struct Engine {
    chai3d::cWorld world; // owns the mesh
    chai3d::cAlgorithmFingerProxy proxy;
};

chai3d::cVector3d in_mm(const double* m) {
    return {kPerMetre * m[0], kPerMetre * m[1], kPerMetre * m[2]};
}

void begin(void* engine, const double* probe_m) {
    auto& own = *static_cast<Engine*>(engine);
    own.proxy.initialize(&own.world, in_mm(probe_m));
}

void frame(void* engine, const double* probe_m, double* proxy_m, double* force_n) {
    auto& own = *static_cast<Engine*>(engine);
    const chai3d::cVector3d force = own.proxy.computeForces(in_mm(probe_m), {0.0, 0.0, 0.0});
    const chai3d::cVector3d proxy = own.proxy.getProxyGlobalPosition();
    const double in_m[] = {proxy.x() / kPerMetre, proxy.y() / kPerMetre, proxy.z() / kPerMetre};
    const double in_n[] = {force.x(), force.y(), force.z()};
    std::copy(in_m, in_m + 3, proxy_m);
    std::copy(in_n, in_n + 3, force_n);
}

} // namespace

int main(int argc, char** argv) {
    entry_track track{};
    const int loaded = argc == 3 ? entry_load(argv[1], &track) : ENTRY_WRONG_INPUT;
    if (loaded != ENTRY_DONE) return loaded;
    const entry_mesh& read = track.mesh;
    if (!read.triangles) return ENTRY_LEFT_OUT;
    auto* mesh = new chai3d::cMesh;
    for (int v = 0; v < read.vertices; ++v)
        mesh->newVertex(in_mm(read.vertex_m[v]));
    for (int t = 0; t < read.triangles; ++t)
        mesh->newTriangle(read.triangle[t][0], read.triangle[t][1], read.triangle[t][2]);
    mesh->computeAllNormals();
    mesh->setStiffness(ENTRY_STIFFNESS / kPerMetre, true); // N/mm
    mesh->createAABBCollisionDetector(0.0);
    Engine engine;
    engine.world.addChild(mesh);
    engine.world.computeGlobalPositions(false);
    engine.proxy.setProxyRadius(0.0);
    engine.proxy.m_useDynamicProxy = true;           // all constraints in each frame
    engine.proxy.m_forceShadingAngleThreshold = 0.0; // facets as they are
    return entry_run(&track, argv[2], &engine, begin, frame);
}
