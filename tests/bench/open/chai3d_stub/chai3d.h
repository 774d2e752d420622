// SPDX-License-Identifier: Apache-2.0
// Not CHAI3D: the names of CHAI3D 3.3 that bench/open/adapters/chai3d.cpp uses, so that the adapter
// is compiled in a test. Nothing is felt: the proxy is where the tool is.
#pragma once

namespace chai3d {

struct cVector3d {
    cVector3d(double x, double y, double z) : m_{x, y, z} {}
    double x() const { return m_[0]; }
    double y() const { return m_[1]; }
    double z() const { return m_[2]; }

private:
    double m_[3];
};

struct cMesh {
    unsigned newVertex(const cVector3d&) { return vertices_++; }
    unsigned newTriangle(unsigned, unsigned, unsigned) { return triangles_++; }
    void computeAllNormals() {}
    void setStiffness(double, bool) {}
    void createAABBCollisionDetector(double) {}

private:
    unsigned vertices_ = 0, triangles_ = 0;
};

struct cWorld {
    ~cWorld() { delete child_; }
    bool addChild(cMesh* child) {
        child_ = child;
        return true;
    }
    void computeGlobalPositions(bool) {}

private:
    cMesh* child_ = nullptr;
};

struct cAlgorithmFingerProxy {
    bool m_useDynamicProxy = false;
    double m_forceShadingAngleThreshold = 0.75;
    void initialize(cWorld*, const cVector3d& position) { proxy_ = position; }
    void setProxyRadius(const double&) {}
    cVector3d computeForces(const cVector3d& tool, const cVector3d&) {
        proxy_ = tool;
        return {0.0, 0.0, 0.0};
    }
    cVector3d getProxyGlobalPosition() const { return proxy_; }

private:
    cVector3d proxy_{0.0, 0.0, 0.0};
};

} // namespace chai3d
