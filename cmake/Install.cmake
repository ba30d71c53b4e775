# bin/pons, its worlds, and the wheels' libraries beside them, so that what is installed does not need .venv.
install(DIRECTORY worlds/ DESTINATION share/pons/worlds)
install(FILES package.xml LICENSE NOTICE DESTINATION share/pons)
install(DIRECTORY docs/schema/ DESTINATION share/pons/schema)
install(DIRECTORY packaging/ DESTINATION share/pons/packaging)

if(TARGET pons)
  # A folder named lib: some of the wheels' libraries look for the others in their own folder, some in ../lib.
  # The second path is for a program with file capabilities: the loader does not follow $ORIGIN for one.
  set_target_properties(pons PROPERTIES INSTALL_RPATH "$ORIGIN/../lib/pons/lib;${CMAKE_INSTALL_PREFIX}/lib/pons/lib")
  install(TARGETS pons RUNTIME_DEPENDENCY_SET pons_libraries RUNTIME DESTINATION bin)
  install(RUNTIME_DEPENDENCY_SET pons_libraries
    POST_EXCLUDE_REGEXES "^/lib/" "^/lib64/" "^/usr/lib/"
    DIRECTORIES "${PONS_PREFIX}/lib"
    LIBRARY DESTINATION lib/pons/lib)
endif()
