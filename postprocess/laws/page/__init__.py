"""The law of any pin joint as one page for a browser, with the law in JavaScript."""
