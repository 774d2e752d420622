// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <utility>

#include <palpate/volume/vector_field.h>

namespace palpate::test {

/// A vector field by a function of the point, for tests that know where it leads.
class FormulaVectorField final : public VectorField {
public:
    using Function = std::function<VectorSample(const Vec3&)>;
    explicit FormulaVectorField(Function function) : function_(std::move(function)) {}

    std::unique_ptr<VectorSampler> make_sampler() const override {
        return std::make_unique<Sampler>(function_);
    }
    Box bounds() const override { return {Vec3(-1.0), Vec3(1.0)}; }
    double feature_size_m() const noexcept override { return 0.01; }

private:
    class Sampler final : public VectorSampler {
    public:
        explicit Sampler(const Function& function) : function_(function) {}
        VectorSample sample(const Vec3& point) noexcept override {
            ++samples_;
            return function_(point);
        }

    private:
        const Function& function_;
    };

    Function function_;
};

} // namespace palpate::test
