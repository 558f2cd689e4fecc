"""What a person wants of a site and its map does not say: cells to keep out of and more, believed from flights and answers.

`layout` is the site and its route as arrays, `search` the ways over it, `wishes` what cells can be, `pilots` how people fly,
`chain` and `tempering` sample maps that explain the flights, `belief` puts them together, `plan` flies by a belief,
`questions` asks.
"""

# The acquisition that learns and asks so.
SITE = 'site'
