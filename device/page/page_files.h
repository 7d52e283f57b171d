// SPDX-License-Identifier: Apache-2.0
// The built page, as the build puts it into the program.
#pragma once

#include "common/http/http_server.h"

#include <vector>

namespace gyre {

const std::vector<PageFile>& device_page_files();

}  // namespace gyre
