// SPDX-License-Identifier: Apache-2.0
// The spool and the uplink as metrics.
#pragma once

#include "common/metrics/metrics.h"
#include "device/spool/spool.h"
#include "device/uplink/uplink.h"

namespace gyre {

// Both outlive the metrics; uplink: null when the device has no host.
void add_link_metrics(Metrics& metrics, const Spool& spool, const Uplink* uplink);

}  // namespace gyre
