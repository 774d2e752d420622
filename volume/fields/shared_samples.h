// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <vector>

#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

/// The same field for the parts of one loop: its samplers share what one of them sampled last.
/// Whoever asks for a sample at that very point gets those bits and pays no query: each query is
/// counted once, by the sampler that made it. value() and first_root() are never shared. Its
/// samplers are not for two threads at once, not even different ones. Null gives null.  [setup]
std::shared_ptr<const ScalarField> share_samples(std::shared_ptr<const ScalarField> field);
std::shared_ptr<const VectorField> share_samples(std::shared_ptr<const VectorField> field);

/// What the samplers of a shared field have in common: the last sample, and where it was taken.
template <class Sample>
struct LastSample {
    Vec3 point{0.0};              ///< m, scene frame
    std::optional<Sample> sample; ///< nothing: none was taken yet
};

/// The fields of one loop, shared by its parts, with what their samplers remember as a value: who
/// asks at the point of the last sample pays no query, so the counts of queries depend on it. The
/// samples themselves do not. Not for two threads at once.
class SharedFields {
public:
    /// share_samples(), and of the same scalar field the same one again.               [setup]
    std::shared_ptr<const ScalarField> share(const std::shared_ptr<const ScalarField>& field);
    std::shared_ptr<const VectorField> share(const std::shared_ptr<const VectorField>& field);

    /// The last samples, in the order in which the fields were shared first.
    struct State {
        std::vector<LastSample<FieldSample>> scalars;
        std::vector<LastSample<VectorSample>> vectors;
    };
    State save_state() const; ///< [setup]
    /// Of the same fields, shared in the same order; without allocation.               [setup]
    void restore_state(const State& state) noexcept;

private:
    std::map<std::shared_ptr<const ScalarField>, std::shared_ptr<const ScalarField>> known_;
    std::vector<std::shared_ptr<LastSample<FieldSample>>> scalars_;
    std::vector<std::shared_ptr<LastSample<VectorSample>>> vectors_;
};

} // namespace palpate
