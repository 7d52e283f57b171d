// SPDX-License-Identifier: Apache-2.0
#include "device/page/page_link.h"

#include "common/qr/qr_text.h"

namespace gyre {

std::string page_link(const std::string& url) {
  return "Scan this with a phone in the same network to see what the rig sees:\n\n" + qr_text(qr_modules(url)) + "\n" +
         url + "\n";
}

}  // namespace gyre
