// SPDX-License-Identifier: Apache-2.0
#include <palpate/geometry/surface_scene.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <palpate/geometry/internal/embree.h>
#include <palpate/geometry/internal/segment_crossing.h>

namespace palpate {
namespace {

constexpr double kEpsilon = std::numeric_limits<double>::epsilon();
// Rounding of a difference of coordinates and of the few products after it, in units of the largest
// coordinate involved.
constexpr double kRoundings = 8.0;
// A float32 ray in the box of half extent L strays by ulp(L)/2 (origin) and 2 sqrt(3) L 2^-24
// (direction) at most, together under 4 ulp(L); boxes are rounded outwards and grown by twice that,
// so that no box of a triangle that is met is passed by.
constexpr double kRayUlps = 8.0;
// Triangles may be widened by this much, and their corners, where the widened edges meet, by about
// twice that: boxes are grown by it as well.
constexpr double kWideningUlps = 8.0;
// Boxes of triangles that are this near to each other overlap, with an ulp for rounding.
constexpr double kNearInWidenings = 8.0;
constexpr double kBoxUlps =
    std::max(kRayUlps + 2.0 * kWideningUlps, 0.5 * kNearInWidenings * kWideningUlps + 1.0);

// A mesh that is smaller than this part of its distance from the origin is taken to have this size:
// its boxes have room, and what is widened is so by 2000 to 4000 roundings of a position there.
constexpr double kLeastHalfExtent = 1.0e-5;

constexpr double kParallel =
    1.0e-30; // m; a segment that moves less along an axis does not leave a slab, nor overflow

float rounded_down(double v) noexcept {
    const float f = static_cast<float>(v);
    return f > v ? std::nextafter(f, -std::numeric_limits<float>::infinity()) : f;
}

float rounded_up(double v) noexcept {
    const float f = static_cast<float>(v);
    return f < v ? std::nextafter(f, std::numeric_limits<float>::infinity()) : f;
}

double ulp32(double v) noexcept {
    const float f = rounded_up(v);
    return static_cast<double>(std::nextafter(f, std::numeric_limits<float>::infinity())) - f;
}

double largest_coordinate(const Vec3& v) noexcept {
    return std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
}

/// The radius of Embree's ball for a distance: its centre is rounded, and so is a squared distance,
/// by a few of float32's relative 6e-8.
float ball_radius(double distance, double rounding) noexcept {
    return rounded_up(distance * (1.0 + 1.0e-6) + rounding);
}

/// The part [first, last] of the segment's t in [0,1] within the box; false when there is none.
bool clip(const Vec3& from, const Vec3& along, const Box& box, double& first,
          double& last) noexcept {
    first = 0.0;
    last = 1.0;
    for (int axis = 0; axis < 3; ++axis) {
        if (std::abs(along[axis]) < kParallel) {
            if (from[axis] < box.lower[axis] || from[axis] > box.upper[axis]) return false;
            continue;
        }
        double enter = (box.lower[axis] - from[axis]) / along[axis];
        double leave = (box.upper[axis] - from[axis]) / along[axis];
        if (enter > leave) std::swap(enter, leave);
        first = std::max(first, enter);
        last = std::min(last, leave);
    }
    return first <= last;
}

} // namespace

bool SurfaceScene::answers_at(const Vec3& point) noexcept {
    return is_finite(point) && largest_coordinate(point) <= kQueryRange;
}

struct SurfaceScene::Embree {
    std::shared_ptr<const TriangleMesh> mesh;
    std::vector<std::uint32_t>
        triangle_of;       // by Embree's primitive: degenerate triangles are left out
    Box bounds;            // of the triangles that are left, grown by box_room
    Vec3 origin{0.0};      // m, scene frame: Embree's zero
    double largest = 0.0;  // m, largest coordinate of a triangle's vertex
    double box_room = 0.0; // m
    double widening = 0.0; // m
    RTCDevice device = nullptr;
    RTCScene scene = nullptr;

    /// One segment on its way through Embree, which hands on its first member.
    struct SegmentQuery {
        internal::RayContext context;
        const Embree* surface;
        internal::Segment segment;
        SegmentOptions options;
        double start; // m, from the segment's start to where Embree's ray begins
        internal::Crossing best;
        std::uint32_t triangle;
        bool found;
    };

    struct NeighbourhoodQuery {
        const Embree* surface;
        std::vector<std::uint32_t>* found;
    };

    struct PairQuery {
        const Embree* surface;
        const std::function<void(std::uint32_t, std::uint32_t)>* found;
    };

    struct BallQuery {
        const Embree* surface;
        Vec3 center;
        double rounding; // m, of the centre in float32
        double best;     // m^2
        Vec3 point;
        std::uint32_t triangle;
        bool found;
    };

    explicit Embree(std::shared_ptr<const TriangleMesh> surface);
    ~Embree() { release(); }
    Embree(const Embree&) = delete;
    Embree& operator=(const Embree&) = delete;

    internal::Corners3 corners(std::uint32_t triangle) const noexcept {
        const auto& t = mesh->triangles[triangle];
        return {mesh->vertices[t[0]], mesh->vertices[t[1]], mesh->vertices[t[2]]};
    }
    SurfaceHit hit(std::uint32_t triangle, const Vec3& point, double distance) const noexcept {
        const internal::Corners3 corner = corners(triangle);
        const Vec3 normal = glm::normalize(glm::cross(corner.b - corner.a, corner.c - corner.a));
        return {point, normal, distance, triangle};
    }
    RTCRayHit ray(const Vec3& start, const Vec3& direction, double length) const noexcept;

    void choose_triangles();
    void commit();
    void release() noexcept;
    void require_no_error() const;

    static void box_of(const RTCBoundsFunctionArguments* arguments);
    static void cross(const RTCIntersectFunctionNArguments* arguments);
    static bool approach(RTCPointQueryFunctionArguments* arguments);
    static bool collect(RTCPointQueryFunctionArguments* arguments);
    static void pair(void* query, RTCCollision* collisions, unsigned count);
};

SurfaceScene::Embree::Embree(std::shared_ptr<const TriangleMesh> surface)
    : mesh(std::move(surface)) {
    if (!mesh) throw std::invalid_argument("surface scene has no mesh; give one");
    choose_triangles();
    const Vec3 half = 0.5 * bounds.extent();
    origin = bounds.center();
    const double ulp = ulp32(std::max(largest_coordinate(half), kLeastHalfExtent * largest));
    box_room = kBoxUlps * ulp;
    widening = kWideningUlps * ulp;
    bounds.lower -= box_room;
    bounds.upper += box_room;
    try {
        commit();
    } catch (...) {
        release();
        throw;
    }
}

void SurfaceScene::Embree::choose_triangles() {
    for (std::size_t v = 0; v < mesh->vertices.size(); ++v) {
        if (!answers_at(mesh->vertices[v]))
            throw std::invalid_argument("vertex " + std::to_string(v) +
                                        " is not finite or beyond 1e6 m; repair the mesh");
    }
    triangle_of.reserve(mesh->triangles.size());
    for (std::size_t t = 0; t < mesh->triangles.size(); ++t) {
        for (const std::uint32_t vertex : mesh->triangles[t])
            if (vertex >= mesh->vertices.size())
                throw std::invalid_argument(
                    "triangle " + std::to_string(t) + " names vertex " + std::to_string(vertex) +
                    " of " + std::to_string(mesh->vertices.size()) + "; repair the mesh");
        const internal::Corners3 corner = corners(static_cast<std::uint32_t>(t));
        if (is_degenerate(corner.a, corner.b, corner.c)) continue;
        triangle_of.push_back(static_cast<std::uint32_t>(t));
        for (const Vec3& p : {corner.a, corner.b, corner.c}) {
            bounds.add(p);
            largest = std::max(largest, largest_coordinate(p));
        }
    }
    if (triangle_of.empty())
        throw std::invalid_argument("mesh has no triangle with an area; give one with a surface");
}

void SurfaceScene::Embree::commit() {
    device = rtcNewDevice(nullptr);
    require_no_error();
    scene = rtcNewScene(device);
    rtcSetSceneFlags(scene, RTC_SCENE_FLAG_ROBUST);
    rtcSetSceneBuildQuality(scene, RTC_BUILD_QUALITY_HIGH);

    // Embree's own triangles let rays through at vertices, ROBUST or not: 0.6 % of those aimed at
    // one. So it is given boxes, and what is in them is decided here.
    RTCGeometry geometry = rtcNewGeometry(device, RTC_GEOMETRY_TYPE_USER);
    rtcSetGeometryUserPrimitiveCount(geometry, static_cast<unsigned>(triangle_of.size()));
    rtcSetGeometryUserData(geometry, this);
    rtcSetGeometryBoundsFunction(geometry, &box_of, nullptr);
    rtcSetGeometryIntersectFunction(geometry, &cross);
    rtcCommitGeometry(geometry);
    rtcAttachGeometry(scene, geometry);
    rtcReleaseGeometry(geometry); // the scene keeps it
    rtcCommitScene(scene);
    require_no_error();
}

void SurfaceScene::Embree::release() noexcept {
    if (scene) rtcReleaseScene(scene);
    if (device) rtcReleaseDevice(device);
}

void SurfaceScene::Embree::require_no_error() const {
    const RTCError error = rtcGetDeviceError(device);
    if (error == RTC_ERROR_NONE) return;
    const std::string what = error == RTC_ERROR_OUT_OF_MEMORY ? "out of memory; use a coarser mesh"
                             : error == RTC_ERROR_UNSUPPORTED_CPU
                                 ? "this processor is not supported; use one with SSE2"
                                 : "error " + std::to_string(error) + "; see RTCError";
    throw std::runtime_error("Embree could not build the surface: " + what);
}

/// What Embree shall follow: float32, from its own zero; everything in range, see kQueryRange.
RTCRayHit SurfaceScene::Embree::ray(const Vec3& start, const Vec3& direction,
                                    double length) const noexcept {
    const Vec3 local = start - origin;
    RTCRayHit result{};
    result.ray.org_x = static_cast<float>(local.x);
    result.ray.org_y = static_cast<float>(local.y);
    result.ray.org_z = static_cast<float>(local.z);
    result.ray.dir_x = static_cast<float>(direction.x);
    result.ray.dir_y = static_cast<float>(direction.y);
    result.ray.dir_z = static_cast<float>(direction.z);
    result.ray.tfar = rounded_up(length);
    result.ray.mask = 0xffffffffu;
    result.hit.geomID = RTC_INVALID_GEOMETRY_ID;
    return result;
}

void SurfaceScene::Embree::box_of(const RTCBoundsFunctionArguments* arguments) {
    const auto& surface = *static_cast<const Embree*>(arguments->geometryUserPtr);
    const internal::Corners3 corner = surface.corners(surface.triangle_of[arguments->primID]);
    const Vec3 lower =
        glm::min(corner.a, glm::min(corner.b, corner.c)) - surface.origin - surface.box_room;
    const Vec3 upper =
        glm::max(corner.a, glm::max(corner.b, corner.c)) - surface.origin + surface.box_room;
    RTCBounds& box = *arguments->bounds_o;
    box.lower_x = rounded_down(lower.x);
    box.lower_y = rounded_down(lower.y);
    box.lower_z = rounded_down(lower.z);
    box.upper_x = rounded_up(upper.x);
    box.upper_y = rounded_up(upper.y);
    box.upper_z = rounded_up(upper.z);
}

void SurfaceScene::Embree::cross(const RTCIntersectFunctionNArguments* arguments) {
    if (!arguments->valid[0]) return; // rtcIntersect1 asks for one ray at a time
    auto& query = *reinterpret_cast<SegmentQuery*>(arguments->context);
    const std::uint32_t triangle = query.surface->triangle_of[arguments->primID];
    const SegmentOptions& options = query.options;
    if (std::find(options.except.begin(), options.except.end(), triangle) != options.except.end())
        return;
    const bool wide = !options.widened.empty() && options.widened[triangle] != 0;
    internal::Crossing crossing;
    if (!internal::crosses(query.segment, query.surface->corners(triangle),
                           wide ? query.surface->widening : 0.0, crossing))
        return;
    if (query.found && (crossing.distance > query.best.distance ||
                        (crossing.distance == query.best.distance && triangle > query.triangle)))
        return;
    query.best = crossing;
    query.triangle = triangle;
    query.found = true;

    // Embree goes on up to here, and a little farther, so that equal hits are seen whatever the
    // order of the boxes.
    auto& ray = *reinterpret_cast<RTCRayHit*>(arguments->rayhit);
    const double end = crossing.distance - query.start + query.surface->box_room;
    ray.ray.tfar = std::min(ray.ray.tfar, rounded_up(std::max(end, 0.0)));
    ray.hit.geomID = arguments->geomID;
    ray.hit.primID = arguments->primID;
}

bool SurfaceScene::Embree::approach(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<BallQuery*>(arguments->userPtr);
    const std::uint32_t triangle = query.surface->triangle_of[arguments->primID];
    const internal::Corners3 corner = query.surface->corners(triangle);
    const Vec3 point = closest_point_on_triangle(query.center, corner.a, corner.b, corner.c);
    const double squared = squared_length(point - query.center);
    if (squared > query.best) return false;
    if (squared == query.best && query.found && triangle > query.triangle) return false;
    query.best = squared;
    query.point = point;
    query.triangle = triangle;
    query.found = true;
    const float radius = ball_radius(std::sqrt(squared), query.rounding);
    if (radius >= arguments->query->radius) return false;
    arguments->query->radius = radius;
    return true;
}

bool SurfaceScene::Embree::collect(RTCPointQueryFunctionArguments* arguments) {
    auto& query = *static_cast<NeighbourhoodQuery*>(arguments->userPtr);
    query.found->push_back(query.surface->triangle_of[arguments->primID]);
    return false;
}

/// Embree tells each pair in both orders, and a triangle with itself.
void SurfaceScene::Embree::pair(void* query, RTCCollision* collisions, unsigned count) {
    const auto& pairs = *static_cast<const PairQuery*>(query);
    for (unsigned i = 0; i < count; ++i)
        if (collisions[i].primID0 < collisions[i].primID1)
            (*pairs.found)(pairs.surface->triangle_of[collisions[i].primID0],
                           pairs.surface->triangle_of[collisions[i].primID1]);
}

SurfaceScene::SurfaceScene(std::shared_ptr<const TriangleMesh> mesh)
    : embree_(std::make_unique<Embree>(std::move(mesh))) {}

SurfaceScene::~SurfaceScene() = default;

bool SurfaceScene::is_away(const Vec3& from, const Vec3& to) const noexcept {
    return glm::any(glm::lessThan(glm::max(from, to), bounds().lower)) ||
           glm::any(glm::greaterThan(glm::min(from, to), bounds().upper));
}

std::optional<SurfaceHit> SurfaceScene::first_hit(const Vec3& from, const Vec3& to,
                                                  const SegmentOptions& options) const noexcept {
    if (!answers_at(from) || !answers_at(to)) return std::nullopt;
    const Vec3 along = to - from;
    const double length = glm::length(along);
    double first = 0.0, last = 1.0;
    if (!(length > 0.0) || !clip(from, along, embree_->bounds, first, last)) return std::nullopt;

    Embree::SegmentQuery query{};
    query.surface = embree_.get();
    query.options = options;
    query.segment.from = from;
    query.segment.direction = along / length;
    query.segment.length = length;
    query.segment.rounding =
        kRoundings * kEpsilon *
        std::max({embree_->largest, largest_coordinate(from), largest_coordinate(to)});
    query.start = first * length;
    RTCRayHit ray = embree_->ray(from + first * along, query.segment.direction,
                                 (last - first) * length + embree_->box_room);
    internal::intersect(embree_->scene, query.context, ray);

    if (!query.found) return std::nullopt;
    return embree_->hit(query.triangle, query.best.point, query.best.distance);
}

std::optional<SurfaceHit> SurfaceScene::closest_point(const Vec3& point,
                                                      double radius_m) const noexcept {
    if (!answers_at(point) || !(radius_m > 0.0) || radius_m > kQueryRange) return std::nullopt;
    const Vec3 to_box =
        glm::max(glm::max(embree_->bounds.lower - point, point - embree_->bounds.upper), 0.0);
    if (squared_length(to_box) > radius_m * radius_m) return std::nullopt;

    const Vec3 center = point - embree_->origin;
    Embree::BallQuery query{};
    query.surface = embree_.get();
    query.center = point;
    query.best = radius_m * radius_m;
    query.rounding = 2.0 * ulp32(largest_coordinate(center));
    RTCPointQuery ball{};
    ball.x = static_cast<float>(center.x);
    ball.y = static_cast<float>(center.y);
    ball.z = static_cast<float>(center.z);
    ball.radius = ball_radius(radius_m, query.rounding);
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(embree_->scene, &ball, &context, &Embree::approach, &query);

    if (!query.found) return std::nullopt;
    return embree_->hit(query.triangle, query.point, std::sqrt(query.best));
}

void SurfaceScene::triangles_near(const Vec3& point, double radius_m,
                                  std::vector<std::uint32_t>& found) const {
    found.clear();
    if (!answers_at(point) || !(radius_m > 0.0) || radius_m > kQueryRange) return;
    const Vec3 center = point - embree_->origin;
    Embree::NeighbourhoodQuery query{embree_.get(), &found};
    RTCPointQuery ball{};
    ball.x = static_cast<float>(center.x);
    ball.y = static_cast<float>(center.y);
    ball.z = static_cast<float>(center.z);
    ball.radius = ball_radius(radius_m, 2.0 * ulp32(largest_coordinate(center)));
    RTCPointQueryContext context;
    rtcInitPointQueryContext(&context);
    rtcPointQuery(embree_->scene, &ball, &context, &Embree::collect, &query);
}

void SurfaceScene::for_pairs_near(
    const std::function<void(std::uint32_t, std::uint32_t)>& found) const {
    Embree::PairQuery query{embree_.get(), &found};
    rtcCollide(embree_->scene, embree_->scene, &Embree::pair, &query);
    embree_->require_no_error();
}

const Box& SurfaceScene::bounds() const noexcept { return embree_->bounds; }

const TriangleMesh& SurfaceScene::mesh() const noexcept { return *embree_->mesh; }

double SurfaceScene::query_error_m() const noexcept {
    return kRoundings * kEpsilon * embree_->largest;
}

double SurfaceScene::widening_m() const noexcept { return embree_->widening; }

double SurfaceScene::near_m() const noexcept { return kNearInWidenings * embree_->widening; }

} // namespace palpate
