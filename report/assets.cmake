# dygraphs is built in, so that a page is self-contained.
set(YOUBOT_DYGRAPHS_DIR /usr/share/javascript/dygraphs CACHE PATH "Folder of dygraph.min.js and dygraph.min.css")
set(YOUBOT_DYGRAPHS_LICENSE /usr/share/doc/libjs-dygraphs/copyright CACHE FILEPATH "Licence of dygraphs")
set(assets
  kDygraphsScript=${YOUBOT_DYGRAPHS_DIR}/dygraph.min.js
  kDygraphsStyle=${YOUBOT_DYGRAPHS_DIR}/dygraph.min.css
  kDygraphsLicense=${YOUBOT_DYGRAPHS_LICENSE}
  kPageScript=${CMAKE_CURRENT_LIST_DIR}/page.js
  kPageStyle=${CMAKE_CURRENT_LIST_DIR}/page.css)
list(TRANSFORM assets REPLACE "^[^=]+=" "" OUTPUT_VARIABLE asset_files)
foreach(file IN LISTS asset_files)
  if(NOT EXISTS ${file})
    message(FATAL_ERROR "${file} is missing: ./dev setup installs libjs-dygraphs; for one elsewhere set YOUBOT_DYGRAPHS_DIR and YOUBOT_DYGRAPHS_LICENSE")
  endif()
endforeach()

embed(youbot_report assets.cpp report/assets.h report ${assets})
