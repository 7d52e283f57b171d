// SPDX-License-Identifier: Apache-2.0
// A machine with devices: scripts run as root in a user-mode Linux kernel on this machine's file system, see uml/.
#pragma once

#include "tests/system/programs.h"
#include "tests/temporary_folder.h"

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

namespace gyre {

class Guest {
 public:
  // What is missing for a guest, as a sentence; empty when nothing is. The kernel is looked for in $GYRE_UML, then in
  // ../shared/testing/uml-dist beside the checkout.
  static std::string lacking();

  // The folder that host and guest share: $OUT in scripts.
  const std::filesystem::path& out() const { return folder_.path(); }

  // Boots, runs the script (which ends at the first command that fails) and returns its exit code, 124 when it took
  // longer than four minutes and 125 when the guest did not come up. $BIN holds the programs of this build.
  // With virtual time waiting costs nothing and computing takes none, so that times are exact however busy this machine
  // is; nothing in the script may wait without sleeping then.
  enum class Time { real, virtual_time };
  int run(const std::string& script, Time time = Time::real);

  // The same without waiting for its end; one at a time.
  void start(const std::string& script);
  bool ended();
  // Like a machine whose power goes: what the guest has not synced is lost, and nothing is told.
  void pull_plug();

  // What the last script printed.
  std::string log() const;

 private:
  std::vector<std::string> command(const std::string& script, Time time) const;

  TemporaryFolder folder_;
  std::unique_ptr<Running> running_;
};

}  // namespace gyre
