// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/shared_samples.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include <gtest/gtest.h>

#include <palpate/volume/fields/analytic_fields.h>

#include "tests/support/formula_fields.h"

namespace palpate {
namespace {

constexpr double kRadius = 0.05; // m

bool same_bits(const FieldSample& a, const FieldSample& b) {
    return std::memcmp(&a.value, &b.value, sizeof a.value) == 0 &&
           std::memcmp(&a.slope, &b.slope, sizeof a.slope) == 0 &&
           std::memcmp(&a.gradient, &b.gradient, sizeof a.gradient) == 0 &&
           std::memcmp(&a.hessian, &b.hessian, sizeof a.hessian) == 0 && a.valid == b.valid;
}

TEST(SharedSamples, ASecondSamplerAtThePointPaysNothing) {
    const auto field = share_samples(make_solid_sphere(kRadius));
    const auto first = field->make_sampler();
    const auto second = field->make_sampler();
    for (int i = 0; i < 10; ++i) {
        const Vec3 point{0.01, 0.002 * i, 0.03};
        const FieldSample of_first = first->sample(point);
        EXPECT_TRUE(same_bits(second->sample(point), of_first));
    }
    EXPECT_EQ(first->samples(), 10u);
    EXPECT_EQ(second->samples(), 0u);
}

// The twin is a sampler that shares with nobody. Points come again, from either sampler, in any
// order, next to zeros of either sign and infinities.
TEST(SharedSamples, GivesTheBitsOfTheFieldWhoeverAsks) {
    const std::shared_ptr<const ScalarField> field = make_torus(0.03, 0.01);
    const auto shared = share_samples(field);
    const auto twin = field->make_sampler();
    const std::unique_ptr<FieldSampler> both[] = {shared->make_sampler(), shared->make_sampler()};
    const double numbers[] = {0.0,    -0.0, 0.03,
                              -0.021, 0.04, std::numeric_limits<double>::infinity()};
    std::mt19937 random(11);
    const auto any = [&](std::size_t n) {
        return std::uniform_int_distribution<std::size_t>(0, n - 1)(random);
    };
    std::uint64_t asked = 0;
    for (int i = 0; i < 5000; ++i) {
        const Vec3 point{numbers[any(2)], numbers[any(2)], numbers[any(6)]};
        ASSERT_TRUE(same_bits(both[any(2)]->sample(point), twin->sample(point)))
            << point.x << ' ' << point.y << ' ' << point.z << " at " << i;
        ++asked;
    }
    EXPECT_LT(both[0]->samples() + both[1]->samples(), asked) << "24 points: some come twice";
}

TEST(SharedSamples, APointThatIsNotANumberIsSampledAsAnyOther) {
    const std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    const auto sampler = share_samples(field)->make_sampler();
    const Vec3 nowhere(std::numeric_limits<double>::quiet_NaN());
    EXPECT_TRUE(std::isnan(sampler->sample(nowhere).value));
    const Vec3 somewhere{0.01, 0.0, 0.0};
    EXPECT_TRUE(same_bits(sampler->sample(somewhere), field->make_sampler()->sample(somewhere)));
}

TEST(SharedSamples, ValuesAndRootsAreTheFieldsAndCounted) {
    const std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    const auto sampler = share_samples(field)->make_sampler();
    const auto twin = field->make_sampler();
    const Vec3 from{0.07, 0.01, 0.0}, to{0.0, 0.0, 0.0};
    EXPECT_EQ(sampler->value(from), twin->value(from));
    EXPECT_EQ(sampler->value(from), twin->value(from));
    EXPECT_EQ(sampler->first_root(from, to, 0.0), twin->first_root(from, to, 0.0));
    EXPECT_EQ(sampler->samples(), 2u);
    EXPECT_EQ(sampler->roots(), 1u);
}

TEST(SharedSamples, VectorsAreSharedToo) {
    int computed = 0;
    const auto field =
        share_samples(std::make_shared<const test::FormulaVectorField>([&](const Vec3& point) {
            ++computed;
            return VectorSample{point, Mat3(1.0), true};
        }));
    const auto first = field->make_sampler();
    const auto second = field->make_sampler();
    for (const double x : {0.1, 0.2, 0.1})
        EXPECT_EQ(first->sample(Vec3(x)).value, second->sample(Vec3(x)).value);
    EXPECT_EQ(computed, 3);
    EXPECT_EQ(first->samples() + second->samples(), 3u);
}

// Two loops over one scene run on two threads: what one samples must not be seen by the other.
TEST(SharedSamples, TwoSharesOfOneFieldKnowNothingOfEachOther) {
    const std::shared_ptr<const ScalarField> field = make_solid_sphere(kRadius);
    const auto of_one_loop = share_samples(field)->make_sampler();
    const auto of_another = share_samples(field)->make_sampler();
    of_one_loop->sample(Vec3(0.01));
    of_another->sample(Vec3(0.01));
    EXPECT_EQ(of_another->samples(), 1u);
}

TEST(SharedFields, GiveOneScalarFieldOnce) {
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(kRadius);
    const std::shared_ptr<const ScalarField> torus = make_torus(0.03, 0.01);
    SharedFields fields;
    const auto shared = fields.share(ball);
    EXPECT_EQ(fields.share(ball), shared);
    EXPECT_NE(fields.share(torus), shared);
    EXPECT_EQ(fields.share(std::shared_ptr<const ScalarField>()), nullptr);
    EXPECT_EQ(fields.share(std::shared_ptr<const VectorField>()), nullptr);
}

TEST(SharedFields, AreAskedAgainAsTheyWereAskedAfterTheSave) {
    const std::shared_ptr<const ScalarField> ball = make_solid_sphere(kRadius);
    const std::shared_ptr<const VectorField> helix = make_helix(0.03, 0.03);
    SharedFields fields;
    const auto scalars = fields.share(ball)->make_sampler();
    const auto vectors = fields.share(helix)->make_sampler();
    const Vec3 here{0.01}, there{0.02};
    const SharedFields::State untouched = fields.save_state();
    const FieldSample first = scalars->sample(here);
    vectors->sample(here);
    const SharedFields::State touched = fields.save_state();
    scalars->sample(there);
    vectors->sample(there);

    fields.restore_state(touched);
    const std::uint64_t scalars_paid = scalars->samples(), vectors_paid = vectors->samples();
    EXPECT_TRUE(same_bits(scalars->sample(here), first));
    vectors->sample(here);
    EXPECT_EQ(scalars->samples(), scalars_paid);
    EXPECT_EQ(vectors->samples(), vectors_paid);

    fields.restore_state(untouched);
    scalars->sample(here);
    vectors->sample(here);
    EXPECT_EQ(scalars->samples(), scalars_paid + 1);
    EXPECT_EQ(vectors->samples(), vectors_paid + 1);
}

} // namespace
} // namespace palpate
