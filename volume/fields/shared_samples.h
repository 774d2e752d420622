// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <memory>

#include <palpate/volume/scalar_field.h>
#include <palpate/volume/vector_field.h>

namespace palpate {

/// The same field for the parts of one loop: its samplers share what one of them sampled last.
/// Whoever asks for a sample at that very point gets those bits and pays no query: each query is
/// counted once, by the sampler that made it. value() and first_root() are never shared. Its
/// samplers are not for two threads at once, not even different ones. Null gives null.  [setup]
std::shared_ptr<const ScalarField> share_samples(std::shared_ptr<const ScalarField> field);
std::shared_ptr<const VectorField> share_samples(std::shared_ptr<const VectorField> field);

} // namespace palpate
