// SPDX-License-Identifier: Apache-2.0
// Stage `report`: report.json and the self-contained report.html.
#pragma once

#include "common/bundle/stage.h"

namespace gyre {

Stage report_stage();

}  // namespace gyre
