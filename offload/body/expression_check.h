// SPDX-License-Identifier: Apache-2.0
// Whether expressions do what their names say.
#pragma once

#include "offload/body/template.h"

#include <string>
#include <vector>

namespace gyre {

// One sentence a fault: names that are missing or not known, expressions that move nothing or the other side, lids that
// do not close, a jaw that does not open, corners of the mouth, brows, cheeks, nose, eyeballs or tongue that go the
// wrong way. Motions are taken where landmarks and parts say the feature is; what has no landmark is not judged.
std::vector<std::string> expression_faults(const BodyTemplate& body);

}  // namespace gyre
