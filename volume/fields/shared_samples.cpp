// SPDX-License-Identifier: Apache-2.0
#include <palpate/volume/fields/shared_samples.h>

#include <bit>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>

namespace palpate {
namespace {

/// Bits, not numbers: a sample at -0 need not have the bits of one at 0.
bool same_bits(const Vec3& a, const Vec3& b) noexcept {
    const auto same = [](double x, double y) {
        return std::bit_cast<std::uint64_t>(x) == std::bit_cast<std::uint64_t>(y);
    };
    return same(a.x, b.x) && same(a.y, b.y) && same(a.z, b.z);
}

/// What all samplers of one loop have in common: a field, a sampler of it, its last sample.
template <class Field, class Sampler, class Sample>
struct Common {
    explicit Common(std::shared_ptr<const Field> shared)
        : field(std::move(shared)), sampler(field->make_sampler()) {}

    std::shared_ptr<const Field> field;
    std::unique_ptr<Sampler> sampler;
    LastSample<Sample> last;
};

template <class Common>
auto sample_of(Common& common, const Vec3& point, std::uint64_t& samples) noexcept {
    if (!common.last.sample || !same_bits(point, common.last.point)) {
        ++samples;
        common.last.sample = common.sampler->sample(point);
        common.last.point = point;
    }
    return *common.last.sample;
}

using CommonScalars = Common<ScalarField, FieldSampler, FieldSample>;
using CommonVectors = Common<VectorField, VectorSampler, VectorSample>;

class SharingSampler final : public FieldSampler {
public:
    explicit SharingSampler(std::shared_ptr<CommonScalars> common) : common_(std::move(common)) {}

    FieldSample sample(const Vec3& point) noexcept override {
        return sample_of(*common_, point, samples_);
    }
    double value(const Vec3& point) noexcept override {
        ++samples_;
        return common_->sampler->value(point);
    }
    std::optional<double> first_root(const Vec3& from, const Vec3& to,
                                     double level) noexcept override {
        ++roots_;
        return common_->sampler->first_root(from, to, level);
    }

private:
    std::shared_ptr<CommonScalars> common_;
};

class SharingVectorSampler final : public VectorSampler {
public:
    explicit SharingVectorSampler(std::shared_ptr<CommonVectors> common)
        : common_(std::move(common)) {}

    VectorSample sample(const Vec3& point) noexcept override {
        return sample_of(*common_, point, samples_);
    }

private:
    std::shared_ptr<CommonVectors> common_;
};

class SharingField final : public ScalarField {
public:
    explicit SharingField(std::shared_ptr<CommonScalars> common) : common_(std::move(common)) {}

    std::unique_ptr<FieldSampler> make_sampler() const override {
        return std::make_unique<SharingSampler>(common_);
    }
    Box bounds() const override { return common_->field->bounds(); }
    Box bounds_at(double level) const override { return common_->field->bounds_at(level); }
    double feature_size_m() const noexcept override { return common_->field->feature_size_m(); }
    double relief_limit_m() const noexcept override { return common_->field->relief_limit_m(); }
    double patch_cosine() const noexcept override { return common_->field->patch_cosine(); }
    double typical_slope(double level) const override {
        return common_->field->typical_slope(level);
    }

private:
    std::shared_ptr<CommonScalars> common_;
};

class SharingVectorField final : public VectorField {
public:
    explicit SharingVectorField(std::shared_ptr<CommonVectors> common)
        : common_(std::move(common)) {}

    std::unique_ptr<VectorSampler> make_sampler() const override {
        return std::make_unique<SharingVectorSampler>(common_);
    }
    Box bounds() const override { return common_->field->bounds(); }
    double feature_size_m() const noexcept override { return common_->field->feature_size_m(); }

private:
    std::shared_ptr<CommonVectors> common_;
};

} // namespace

std::shared_ptr<const ScalarField> share_samples(std::shared_ptr<const ScalarField> field) {
    if (!field) return nullptr;
    return std::make_shared<SharingField>(std::make_shared<CommonScalars>(std::move(field)));
}

std::shared_ptr<const VectorField> share_samples(std::shared_ptr<const VectorField> field) {
    if (!field) return nullptr;
    return std::make_shared<SharingVectorField>(std::make_shared<CommonVectors>(std::move(field)));
}

std::shared_ptr<const ScalarField>
SharedFields::share(const std::shared_ptr<const ScalarField>& field) {
    if (!field) return nullptr;
    std::shared_ptr<const ScalarField>& one = known_[field];
    if (one) return one;
    const auto common = std::make_shared<CommonScalars>(field);
    scalars_.emplace_back(common, &common->last);
    return one = std::make_shared<SharingField>(common);
}

std::shared_ptr<const VectorField>
SharedFields::share(const std::shared_ptr<const VectorField>& field) {
    if (!field) return nullptr;
    const auto common = std::make_shared<CommonVectors>(field);
    vectors_.emplace_back(common, &common->last);
    return std::make_shared<SharingVectorField>(common);
}

SharedFields::State SharedFields::save_state() const {
    State state;
    for (const auto& last : scalars_)
        state.scalars.push_back(*last);
    for (const auto& last : vectors_)
        state.vectors.push_back(*last);
    return state;
}

void SharedFields::restore_state(const State& state) noexcept {
    for (std::size_t i = 0; i < scalars_.size(); ++i)
        *scalars_[i] = state.scalars[i];
    for (std::size_t i = 0; i < vectors_.size(); ++i)
        *vectors_[i] = state.vectors[i];
}

} // namespace palpate
