# Writes DOCUMENTS, paths below SOURCE, to OUTPUT. In the source tree their commands run from its top folder; installed,
# from any, since they name what is below CMAKE_INSTALL_PREFIX.
file(REMOVE_RECURSE ${OUTPUT})
set(shared ${CMAKE_INSTALL_PREFIX}/share/youbot-hal)
foreach(document IN LISTS DOCUMENTS)
  file(READ ${SOURCE}/${document} text)
  string(REPLACE "build/bin/youbot" "youbot" text "${text}")
  string(REPLACE "/usr/share/youbot-hal" "${shared}" text "${text}")
  string(REGEX REPLACE "apps/[a-z_]+/([a-z_]+\\.toml)" "${shared}/\\1" text "${text}")
  string(REPLACE "apps/youbot_sim/thesis" "${shared}/thesis" text "${text}")
  string(REGEX REPLACE "in[ \n]the top folder of the source tree" "in any folder" text "${text}")
  file(WRITE ${OUTPUT}/${document} "${text}")
endforeach()
