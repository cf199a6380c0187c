# SPDX-License-Identifier: Apache-2.0
# expect: dbc/cubemars.dbc does not describe a command of each of twelve drives
# Of eleven drives only.
sed -i "0,/^BO_ /{/^BO_ /d}" usr/share/polygmap/dbc/cubemars.dbc
