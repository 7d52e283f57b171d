// SPDX-License-Identifier: Apache-2.0
#include "offload/orbit.h"

#include "offload/avatar/avatar_stage.h"
#include "offload/cameras/cameras_stage.h"
#include "offload/cloud/cloud_stage.h"
#include "offload/fit/fit_stage.h"
#include "offload/landmarks/landmarks_stage.h"
#include "offload/report/report_stage.h"
#include "offload/texture/texture_stage.h"

namespace gyre {

std::vector<Stage> orbit_stages() {
  return {cameras_stage(), cloud_stage(),  landmarks_stage(), fit_stage(),
          texture_stage(), avatar_stage(), report_stage()};
}

}  // namespace gyre
