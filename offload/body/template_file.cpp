// SPDX-License-Identifier: Apache-2.0
#include "offload/body/template.h"
namespace gyre {
Result<BodyTemplate> read_template(const std::filesystem::path& file) { return fail("cannot read template", file.string()); }
Result<void> write_template(const BodyTemplate&, const std::filesystem::path& file) { return fail("cannot write template", file.string()); }
}  // namespace gyre
